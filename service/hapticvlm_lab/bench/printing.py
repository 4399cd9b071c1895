"""The end of a chart: its figures in a JSON file, and printed as JSON or as a table for people."""

from __future__ import annotations

import json
import platform
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np

from hapticvlm import __version__


def publish(
    stem: Path,
    figures: Mapping[str, object],
    files: Sequence[Path],
    *,
    as_json: bool,
    show: Callable[[], None],
) -> int:
    """Write figures into `stem`.json, and print them, or `show` them and name the drawn files.

    With them go the versions and the machine that they depend on.
    """
    whole = {
        **figures,
        "version": __version__,
        "machine": platform.machine(),
        "python": platform.python_version(),
        "numpy": np.__version__,
        "files": [str(path) for path in files],
    }
    stem.with_name(f"{stem.name}.json").write_text(json.dumps(whole, indent=1) + "\n", "utf-8")
    if as_json:
        print(json.dumps(whole))
        return 0
    show()
    for path in files:
        print(f"wrote {path}")
    return 0
