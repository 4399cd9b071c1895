"""`hapticvlm chart`, `stability` and `measure`, which the command line adds in a checkout."""

from __future__ import annotations

from hapticvlm.commands.parsing import Commands
from hapticvlm_lab.commands import charts, measure


def add(commands: Commands) -> None:
    """Declare the commands."""
    charts.add(commands)
    measure.add(commands)
