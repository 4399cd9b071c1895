"""The commands `hapticvlm feel`, `export`, `bake`, `evaluate`, `calibrate` and `study`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hapticvlm_studio.commands import bake, calibrate_thermal, evaluate, export, feel, study

if TYPE_CHECKING:
    from hapticvlm.commands.parsing import Commands


def add(commands: Commands) -> None:
    """Declare the commands."""
    for part in (feel, export, bake, evaluate, calibrate_thermal, study):
        part.add(commands)
