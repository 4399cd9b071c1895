"""Tables beside tests: CSV files whose first column names what a row is of, or JSON by name."""

import csv
import json
from pathlib import Path
from typing import Any


def words(table: Path, name: str) -> list[tuple[str, ...]]:
    """Return the further columns of the rows with this name; an empty cell is an empty text."""
    with table.open(newline="", encoding="utf-8") as file:
        rows = [tuple(cells) for first, *cells in csv.reader(file) if first == name]
    assert rows, f"{table.name} has no row `{name}`"
    return rows


def cases(table: Path, name: str) -> list[Any]:
    """Return the list of this name in a JSON file."""
    rows: list[Any] = json.loads(table.read_text(encoding="utf-8"))[name]
    return rows
