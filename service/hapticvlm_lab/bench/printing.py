"""The last lines that a chart prints for people: which files it wrote."""

from __future__ import annotations

from collections.abc import Mapping


def print_files(figures: Mapping[str, object]) -> None:
    """Print the path of each file in `figures["files"]`."""
    files = figures["files"]
    assert isinstance(files, list)
    for path in files:
        print(f"wrote {path}")
