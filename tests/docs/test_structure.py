"""What tests may import: helpers of tests/support, and nothing of another test file."""

import re
from pathlib import Path

TESTS = Path(__file__).parents[1]
OTHERS = re.compile(r"^\s*(?:from|import) (?:[\w.]+\.)?test_\w+", re.MULTILINE)


def test_no_file_imports_a_file_of_tests() -> None:
    files = [path for path in TESTS.rglob("*.py") if "node_modules" not in path.parts]
    texts = {str(path.relative_to(TESTS)): path.read_text(encoding="utf-8") for path in files}
    assert {name: OTHERS.findall(text) for name, text in texts.items() if OTHERS.search(text)} == {}
