"""A folder of compiled files that all workers of one run share."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest


def built_once(
    temporary: pytest.TempPathFactory, name: str, build: Callable[[Path], object]
) -> Path:
    """Return the folder that `build` filled, in the worker of this run that needed it first.

    The others wait meanwhile. A build that fails leaves no mark, so that the next worker tries it
    and fails with the same message.
    """
    import fcntl  # Unix only, as the compilers are here

    base = temporary.getbasetemp()
    run = base.parent if "PYTEST_XDIST_WORKER" in os.environ else base
    folder = run / name
    folder.mkdir(exist_ok=True)
    with (run / f"{name}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not (folder / "done").exists():
            build(folder)
            (folder / "done").touch()
    return folder
