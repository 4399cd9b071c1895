"""The end of a chart: its figures in a JSON file, and printed as JSON or as a table for people."""

from __future__ import annotations

import json
import platform
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from hapticvlm import __version__


def made_with() -> dict[str, str]:
    """Return the versions and the machine that the figures depend on."""
    return {
        "version": __version__,
        "machine": platform.machine(),
        "python": platform.python_version(),
        "numpy": np.__version__,
    }


def publish(
    file: Path, figures: Mapping[str, object], *, as_json: bool, show: Callable[[], None]
) -> int:
    """Write figures into a file, and print them, or `show` them and name `figures["files"]`."""
    file.write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")
    if as_json:
        print(json.dumps(figures))
        return 0
    show()
    files = figures["files"]
    assert isinstance(files, list)
    for path in files:
        print(f"wrote {path}")
    return 0
