"""Writes `.ahap` of Apple's Core Haptics: continuous events with curves of two parameters. Pure.

Times are in s. Intensity is 0..1 and acts on the amplitude by its square; sharpness is 0..1,
without a unit. So both are the square roots of what `.haptic` holds for the same touch (after
Meta's converter). A parameter curve takes at most 16 points, whose times count from the start of
the curve (Apple, CHHapticParameterCurve.ControlPoint); a longer one is split into curves that each
begin with the last point of the previous one. An event lasts 30 s at most. The format has no heat.
These files have not been played on a device.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import count, takewhile
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hapticvlm.touches.clip import Clip
from hapticvlm.touches.haptic import relative_frequency

MAX_POINTS = 16
MAX_EVENT_S = 30.0


def document(clip: Clip) -> dict[str, Any]:
    """Return the clip as a JSON document."""
    # The power goes into the fit itself, so that squared straight lines, and not the square roots
    # of fitted lines, have the energy of what the speaker plays.
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
    # Full intensity and no sharpness: the curves multiply the one and add to the other.
    for begin in takewhile(lambda at: at < duration_s, count(0.0, MAX_EVENT_S)):
        yield {
            "Event": {
                "EventType": "HapticContinuous",
                "Time": begin,
                "EventDuration": round(min(MAX_EVENT_S, duration_s - begin), 3),
                "EventParameters": [
                    {"ParameterID": "HapticIntensity", "ParameterValue": 1.0},
                    {"ParameterID": "HapticSharpness", "ParameterValue": 0.0},
                ],
            }
        }


def _curves(
    name: str, times_s: NDArray[np.float64], values: NDArray[np.float64]
) -> Iterator[dict[str, Any]]:
    for first in range(0, times_s.size - 1, MAX_POINTS - 1):
        part = slice(first, first + MAX_POINTS)
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
