"""`hapticvlm calibrate`: adapts the service to a palm, a plate or a speaker."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hapticvlm_studio.commands import calibrate_plate, calibrate_speaker

if TYPE_CHECKING:
    from hapticvlm.commands.parsing import Commands


def add(commands: Commands) -> None:
    """Declare the command and its subjects."""
    calibrate = commands.add_parser(
        "calibrate",
        help="adapt the service to a person or a speaker",
        description="Adapt the service to a person or to a speaker.",
    )
    subjects = calibrate.add_subparsers(title="subjects", required=True, metavar="WHAT")
    for subject in (calibrate_plate, calibrate_speaker):
        subject.add(subjects)
