"""The colours of every figure, and how it is drawn; those of the pages are in pages/palette.css.

Ink, ground and lines are the pages' own. What is told apart by colour has Okabe and Ito's colours
(2008), which colour-blind readers tell apart too, and differs in marker or dash as well.
"""

from __future__ import annotations

from types import MappingProxyType
from typing import Any

GROUND = "#ffffff"
INK = "#15202a"
SOFT = "#4d5b67"
GRID = "#d3dbe1"
# vibration, what was asked, the plate
WAVE = "#0b7468"
SETPOINT = "#1d5b8f"
WARM = "#a63c06"
GOOD = "#1a7f37"
BAD = "#b3261e"
UNSURE = "#8a6100"
BLUE = "#0072b2"
VERMILION = "#d55e00"
GREEN = "#009e73"
ORANGE = "#e69f00"
SKY = "#56b4e9"
PURPLE = "#cc79a7"
GREY = "#8a8f96"

# rc parameters of matplotlib: the same figure gives the same bytes, and text stays text.
FIGURE: Any = MappingProxyType(
    {"font.size": 9, "svg.hashsalt": "hapticvlm", "svg.fonttype": "none"}
)
