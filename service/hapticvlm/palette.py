"""The colours of every figure, and how it is drawn; those of the pages are in pages/palette.css.

Ink, ground and lines are the pages' own. What is told apart by colour has Okabe and Ito's colours
(2008), which colour-blind readers tell apart too, and differs in marker or dash as well.
"""

from __future__ import annotations

from types import MappingProxyType
from typing import Any

GROUND, INK, SOFT, GRID = "#ffffff", "#15202a", "#4d5b67", "#d3dbe1"
WAVE, SETPOINT, WARM = "#0b7468", "#1d5b8f", "#a63c06"  # vibration, what was asked, the plate
GOOD, BAD, UNSURE = "#1a7f37", "#b3261e", "#8a6100"
BLUE, VERMILION, GREEN, ORANGE = "#0072b2", "#d55e00", "#009e73", "#e69f00"
SKY, PURPLE, GREY = "#56b4e9", "#cc79a7", "#8a8f96"

# rc parameters of matplotlib: the same figure gives the same bytes, and text stays text.
FIGURE: Any = MappingProxyType(
    {"font.size": 9, "svg.hashsalt": "hapticvlm", "svg.fonttype": "none"}
)
