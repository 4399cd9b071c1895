"""How long the sentences of pages are: `python -m hapticvlm_lab.bench.sentences README.md`.

Prints lines, sentences, mean words and the longest sentence of each page. A cell of a table and an
item of a list end a sentence, headings are none; code counts as one word, a link as its text.
"""

from __future__ import annotations

import argparse
import re
import sys
from dataclasses import dataclass
from pathlib import Path

_FENCED = re.compile(r"^(```|~~~).*?^\1[^\S\n]*$", re.MULTILINE | re.DOTALL)
_CODE, _PICTURE = re.compile(r"`[^`\n]*`"), re.compile(r"!\[[^\]]*\]\([^)]*\)")
_LINK = re.compile(r"\[([^\]]*)\]\([^)]*\)")
_BREAK = re.compile(r"\n\s*\n|\n(?=\s*(?:[-*|#>]|\d+\.)\s?)|^#.*\n|\|", re.MULTILINE)
_END = re.compile(r"(?<=[.!?:;])[\"')*]*\s+(?=[\"'(*]*[A-Z0-9`])")
_WORD = re.compile(r"[A-Za-zÀ-ž0-9][\w.,'/-]*")


@dataclass(frozen=True, slots=True)
class Page:
    """One page: its lines and the sentences a person reads."""

    lines: int
    sentences: tuple[str, ...]

    @property
    def mean_words(self) -> float:
        """Mean length of a sentence."""
        return sum(map(words, self.sentences)) / max(1, len(self.sentences))

    @property
    def longest(self) -> str:
        """The sentence with most words."""
        return max(self.sentences, key=words, default="")


def words(sentence: str) -> int:
    """Count the words of a sentence."""
    return len(_WORD.findall(sentence))


def read(markdown: str) -> Page:
    """Take a page of Markdown apart."""
    text = _PICTURE.sub("", _FENCED.sub("\n\n", markdown))
    text = _CODE.sub("`code`", _LINK.sub(r"\1", text))
    parts = [part for block in _BREAK.split(text) for part in _END.split(block)]
    sentences = tuple(" ".join(part.split()) for part in parts if words(part) > 1)
    return Page(len(markdown.splitlines()), sentences)


def main() -> int:
    """Read the command line and print a row a page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("pages", type=Path, nargs="+", help="Markdown files")
    for path in parser.parse_args().pages:
        page = read(path.read_text(encoding="utf-8"))
        print(
            f"{path}: {page.lines} lines, {len(page.sentences)} sentences, "
            f"mean {page.mean_words:.1f} words, longest {words(page.longest)}: {page.longest}"
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
