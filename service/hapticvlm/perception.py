"""What skin can feel: vibrotactile and thermal thresholds. Pure; knows no device."""

from __future__ import annotations

NEUTRAL_C = 32.0  # degC, resting palm and QST baseline (physics reference 1.1)
THERMAL_FLOOR_C = 0.2  # degC, thenar warm threshold, the larger of the two (reference 1.3, from memory)
