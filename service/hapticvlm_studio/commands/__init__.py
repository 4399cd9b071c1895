"""The commands `hapticvlm evaluate`, `calibrate` and `study`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hapticvlm_studio.commands import calibrate, evaluate, study

if TYPE_CHECKING:
    from hapticvlm.commands.parsing import Commands


def add(commands: Commands) -> None:
    """Declare the commands."""
    for part in (evaluate, calibrate, study):
        part.add(commands)
