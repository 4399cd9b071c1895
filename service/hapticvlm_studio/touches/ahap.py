"""`.ahap` of Apple's Core Haptics: one long event, its intensity and sharpness as curves. Pure.

Intensity is felt quadratically and sharpness is relative, so both are square roots of what .haptic
holds, as Meta's converter has it. A curve takes 16 points; each begins with the last of the one
before, and its times count from its own start (Apple, CHHapticParameterCurve.ControlPoint). An
event lasts 30 s at most. The format has no heat. No device has played these files here.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import count, takewhile
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hapticvlm_studio.touches.clip import Clip
from hapticvlm_studio.touches.haptic import relative_frequency

MOST_POINTS = 16
LONGEST_EVENT_S = 30.0


def document(clip: Clip) -> dict[str, Any]:
    """Return the JSON document."""
    intensity = clip.points(power=2.0)
    sharpness = np.sqrt(np.asarray(relative_frequency(clip)))
    return {
        "Version": 1.0,
        "Metadata": {"Description": f"{clip.interaction} on {clip.material}, by HapticVLM"},
        "Pattern": [
            *_events(float(clip.times_s[-1])),
            *_curves("HapticIntensityControl", clip.times_s, intensity),
            *_curves("HapticSharpnessControl", clip.times_s, sharpness),
        ],
    }


def _events(duration_s: float) -> Iterator[dict[str, Any]]:
    for begin in takewhile(lambda at: at < duration_s, count(0.0, LONGEST_EVENT_S)):
        yield {
            "Event": {
                "EventType": "HapticContinuous",
                "Time": begin,
                "EventDuration": round(min(LONGEST_EVENT_S, duration_s - begin), 3),
                "EventParameters": [
                    {"ParameterID": "HapticIntensity", "ParameterValue": 1.0},
                    {"ParameterID": "HapticSharpness", "ParameterValue": 0.0},
                ],
            }
        }


def _curves(
    name: str, times_s: NDArray[np.float64], values: NDArray[np.float64]
) -> Iterator[dict[str, Any]]:
    for first in range(0, times_s.size - 1, MOST_POINTS - 1):
        part = slice(first, first + MOST_POINTS)
        begin = float(times_s[first])
        yield {
            "ParameterCurve": {
                "ParameterID": name,
                "Time": round(begin, 3),
                "ParameterCurveControlPoints": [
                    {"Time": round(float(at) - begin, 3), "ParameterValue": round(float(value), 4)}
                    for at, value in zip(times_s[part], values[part], strict=True)
                ],
            }
        }
