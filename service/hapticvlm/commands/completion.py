"""`hapticvlm completion` prints a script with which a shell completes commands and options."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hapticvlm.commands.parsing import Commands

SHELLS = ("bash", "zsh", "fish", "tcsh", "powershell")

_DESCRIPTION = """
Print a completion script for your shell. Once the shell has read it, the Tab key completes commands
and options. The script is static: pressing Tab does not start Python. Needs the extra `completion`
(shtab).
"""


def add(commands: Commands, whole: argparse.ArgumentParser) -> None:
    """Declare the command; it completes what `whole` declares."""
    completion = commands.add_parser(
        "completion",
        help="print a completion script for your shell",
        description=_DESCRIPTION,
        examples=(
            'eval "$(hapticvlm completion bash)"        in ~/.bashrc',
            "hapticvlm completion zsh > _hapticvlm      in a folder of $fpath",
            "hapticvlm completion fish > ~/.config/fish/completions/hapticvlm.fish",
        ),
    )
    completion.add_argument("shell", choices=SHELLS, metavar="SHELL", help=", ".join(SHELLS))
    completion.set_defaults(run=lambda options: _print(whole, options.shell))


def _print(whole: argparse.ArgumentParser, shell: str) -> int:
    import shtab

    print(shtab.complete(whole, shell))
    return 0
