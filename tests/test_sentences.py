"""What a person reads is short: README, CHANGELOG, CONTRIBUTING, docs, firmware, clients."""

from pathlib import Path

from each_case import each
from sentences import read, words

ROOT = Path(__file__).parents[1]
README = ROOT / "README.md"
FOR_DEVELOPERS = {"physics.md", "player.md"}  # tables of figures and rules, with their conditions
PAGES = [
    README,
    *(ROOT / name for name in ("SECURITY.md", "CHANGELOG.md", "CONTRIBUTING.md")),
    *(page for page in sorted((ROOT / "docs").rglob("*.md")) if page.name not in FOR_DEVELOPERS),
    *sorted((ROOT / "examples").glob("*/README.md")),
    *(ROOT / name for name in ("examples/webxr/client/README.md", "unity_client/README.md")),
    ROOT / "firmware/README.md",
    ROOT / "firmware/ONE_RESISTOR.md",
]
MOST_WORDS, MOST_LINES, MEAN_WORDS = 30, 130, 15


@each(page=PAGES)
def test_no_sentence_is_longer_than_one_can_hold(page: Path) -> None:
    found = read(page.read_text(encoding="utf-8"))

    assert found.sentences
    assert [one for one in found.sentences if words(one) > MOST_WORDS] == []


def test_the_readme_is_short_and_so_are_its_sentences() -> None:
    found = read(README.read_text(encoding="utf-8"))

    assert found.lines <= MOST_LINES
    assert found.mean_words <= MEAN_WORDS


def test_code_links_and_cells_are_counted_as_a_person_reads_them() -> None:
    text = (
        "# A title\nOne `a b c d` and [a link](https://x.org/y). Two follow:\n- an item\n- more\n"
    )
    table = "\n| first cell | second one here |\n|---|---|\n\n```\nnot read at all\n```\n"

    found = read(text + table).sentences

    assert found == (
        "One `code` and a link.",
        "Two follow:",
        "- an item",
        "first cell",
        "second one here",
    )
    assert words(found[0]) == 5
