"""Checks SECURITY.md: every claim names a test, and every named test exists."""

import ast
import re
from pathlib import Path

from each_case import each_row

TESTS = Path(__file__).parents[1]
TEXT = (TESTS.parent / "SECURITY.md").read_text(encoding="utf-8")
NAMED = re.compile(r"`([\w/]+\.py)?(?:::(test_\w+))?`")


def named() -> list[tuple[str, str]]:
    """Every named file and test; `::test` alone belongs to the file named before it."""
    pairs = []
    file = ""
    for match in NAMED.finditer(TEXT):
        file = match[1] or file
        if match[1] or match[2]:
            pairs.append((file, match[2] or ""))
    return [(file, test) for file, test in pairs if "/hapticvlm/" not in file]


def tables() -> list[list[str]]:
    """The cells of every row of every table, without heads and rules."""
    rows = re.findall(r"^\|(.+)\|$", TEXT, re.MULTILINE)
    cells = [[cell.strip() for cell in row.split("|")] for row in rows]
    heads = [number + 1 for number, row in enumerate(cells) if set(row[0]) == {"-"}]
    return [row for number, row in enumerate(cells) if not {number + 1, number + 2} & set(heads)]


@each_row(("file", "test"), named())
def test_a_test_that_it_names_is_there(file: str, test: str) -> None:
    source = (TESTS / file).read_text(encoding="utf-8")

    assert not test or f"def {test}(" in source


def test_every_row_of_its_tables_names_a_test() -> None:
    assert len(tables()) > 20
    assert [row[0] for row in tables() if "test_" not in row[-1]] == []


def is_left_to_the_night(file: str, test: str) -> bool:
    """Whether a file as a whole or this test of it is marked `nightly`."""
    marks: list[ast.expr] = []
    for node in ast.parse((TESTS / file).read_text(encoding="utf-8")).body:
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "pytestmark":
            marks += node.value.elts if isinstance(node.value, ast.List) else [node.value]
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and node.name == test:
            marks += node.decorator_list
    return "pytest.mark.nightly" in map(ast.unparse, marks)


def test_what_it_names_runs_with_every_push() -> None:
    assert [pair for pair in named() if is_left_to_the_night(*pair)] == []
