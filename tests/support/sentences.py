"""Sentences of Markdown pages: a cell of a table and an item of a list end one, headings are none.

Code counts as one word, a link as its text.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

_FENCED = re.compile(r"^ *(```|~~~).*?^ *\1[^\S\n]*$", re.MULTILINE | re.DOTALL)
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
