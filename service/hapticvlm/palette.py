"""Defines the colours and drawing parameters of every figure; pages/palette.css is for the pages.

Ink, ground and lines have the colours of the pages. Series use the colours of Okabe and Ito (2008),
which colour-blind readers can distinguish, and also differ in marker or dash.
"""

from __future__ import annotations

from types import MappingProxyType
from typing import Any

GROUND = "#ffffff"
INK = "#15202a"
SOFT = "#4d5b67"
GRID = "#d3dbe1"
BLUE = "#0072b2"
VERMILION = "#d55e00"
GREEN = "#009e73"
ORANGE = "#e69f00"
PURPLE = "#cc79a7"
GREY = "#8a8f96"

# rc parameters of matplotlib: the same figure gives the same bytes, and text is not outlined.
FIGURE: Any = MappingProxyType(
    {"font.size": 9, "svg.hashsalt": "hapticvlm", "svg.fonttype": "none"}
)
