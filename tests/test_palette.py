"""Tests that figures have the colours of the pages."""

import re
from pathlib import Path

from hapticvlm import palette

ROOT = Path(__file__).parents[1]
CSS = (ROOT / "service/hapticvlm/pages/palette.css").read_text(encoding="utf-8")


def css(name: str) -> str:
    """Colour of a custom property in the light scheme, six digits."""
    digits = re.findall(rf"--{name}: light-dark\(#(\w+), #\w+\)", CSS)[0]
    return "#" + (digits if len(digits) == 6 else "".join(2 * digit for digit in digits))


def test_figures_have_the_ink_and_the_lines_of_the_pages() -> None:
    for name, property_ in {"INK": "ink", "SOFT": "soft", "GRID": "line"}.items():
        assert getattr(palette, name) == css(property_), name
