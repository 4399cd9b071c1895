"""`hapticvlm study`: a forced-choice study of what people feel, from its file to its report."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hapticvlm_studio.commands import match, new, report, run

if TYPE_CHECKING:
    from hapticvlm.commands.parsing import Commands


def add(commands: Commands) -> None:
    """Declare the command and its parts."""
    study = commands.add_parser(
        "study",
        help="run a study of what people feel and report it",
        description="Run a forced-choice study of what people feel, and evaluate it.",
    )
    parts = study.add_subparsers(title="parts", required=True, metavar="PART")
    for part in (new, run, report, match):
        part.add(parts)
