"""`hapticvlm study report`: evaluates a study, or the paper's data."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from hapticvlm.commands.parsing import add_json

if TYPE_CHECKING:
    from hapticvlm.commands.parsing import Commands

_REPORT = """
Evaluate a study: recognition with intervals, confusion matrices, reaction times, ratings, and
information transmitted. Tests are a two-way repeated-measures ANOVA and Friedman's of those who
felt every pattern, and pairwise tests after Holm. DIR/report/report.html is one file with its
pictures inside that you can send to others. It says what may be claimed and what may not. Text,
JSON and CSV files of all trials and participants are written next to it. --paper evaluates the data
of the HapticVLM paper.
"""


def add(parts: Commands) -> None:
    """Declare `study report`."""
    report = parts.add_parser(
        "report",
        help="evaluate a study",
        description=_REPORT,
        examples=("hapticvlm study report pilot", "hapticvlm study report --paper --out paper"),
    )
    report.set_defaults(run=_report)
    report.add_argument("folder", type=Path, metavar="DIR", nargs="?", help="folder of the study")
    report.add_argument("--paper", action="store_true", help="evaluate the paper's data")
    report.add_argument(
        "--out", type=Path, metavar="FOLDER", help="write the files here (DIR/report)"
    )
    report.add_argument(
        "--for",
        dest="program",
        choices=("excel",),
        help="write CSV files as Excel opens them where the decimal mark is a comma: semicolons "
        "and decimal commas",
    )
    add_json(report)


def _report(options: argparse.Namespace) -> int:
    from hapticvlm.commands.progress import working
    from hapticvlm_studio.design.stimuli import StudyError
    from hapticvlm_studio.report.report import report, report_paper

    if options.paper == (options.folder is not None):
        raise StudyError("give the folder of a study, or --paper")
    with working("evaluating the study"):
        if options.paper:
            summary = report_paper(options.out, as_json=options.json)
        else:
            summary = report(
                options.folder,
                options.out,
                as_json=options.json,
                decimal_comma=options.program == "excel",
            )
    print(summary)
    return 0
