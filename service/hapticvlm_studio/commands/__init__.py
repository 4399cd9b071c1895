"""The commands `hapticvlm evaluate`, `calibrate` and `study`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hapticvlm_studio.commands import (
    calibrate_plate,
    calibrate_speaker,
    evaluate,
    match,
    new,
    report,
    run,
)

if TYPE_CHECKING:
    from hapticvlm.commands.parsing import Commands


def add(commands: Commands) -> None:
    """Declare the commands."""
    evaluate.add(commands)
    calibrate = commands.add_parser(
        "calibrate",
        help="adapt the service to a person or a speaker",
        description="Adapt the service to a person or to a speaker.",
    )
    subjects = calibrate.add_subparsers(title="subjects", required=True, metavar="WHAT")
    for subject in (calibrate_plate, calibrate_speaker):
        subject.add(subjects)
    study = commands.add_parser(
        "study",
        help="run a study of what people feel and report it",
        description="Run a forced-choice study of what people feel, and evaluate it.",
    )
    parts = study.add_subparsers(title="parts", required=True, metavar="PART")
    for part in (new, run, report, match):
        part.add(parts)
