"""Word tables beside tests: CSV files whose first column names the test that a row is of."""

import csv
from pathlib import Path


def words(table: Path, name: str) -> list[tuple[str, ...]]:
    """Return the further columns of the rows with this name; an empty cell is an empty text."""
    with table.open(newline="", encoding="utf-8") as file:
        rows = [tuple(cells) for first, *cells in csv.reader(file) if first == name]
    assert rows, f"{table.name} has no row `{name}`"
    return rows
