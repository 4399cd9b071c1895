"""A command of `hapticvlm` run in this process: a process of its own costs a second of start."""

from __future__ import annotations

import io
from contextlib import chdir, redirect_stderr, redirect_stdout
from dataclasses import dataclass
from pathlib import Path

from hapticvlm.commands.main import main


@dataclass(frozen=True)
class Outcome:
    """The exit code of a command and what it printed."""

    code: int
    out: str
    err: str


def hapticvlm(*arguments: str | Path, cwd: Path | str = ".") -> Outcome:
    """Run `hapticvlm` with these arguments in this folder; what it raises fails the test."""
    out, err = io.StringIO(), io.StringIO()
    with redirect_stdout(out), redirect_stderr(err), chdir(cwd):
        try:
            code = main([str(argument) for argument in arguments])
        except SystemExit as ended:  # of argparse
            code = int(ended.code or 0)
    return Outcome(code, out.getvalue(), err.getvalue())
