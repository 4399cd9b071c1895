"""`.haptic` 1.0 of Meta's Haptics SDK: an amplitude and a frequency envelope, both 0..1. Pure.

Rules: the file format specification of facebook/meta-haptics-sdk (MIT). The format has no heat, and
its frequency is relative; 0 and 1 are the ends of a Quest controller's range. No emphasis is
written: the envelope already holds the impact, and an emphasis would be felt on top of it.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hapticvlm import __version__
from hapticvlm_studio.touches.clip import Clip

# of a Quest controller, by its ACF file in that SDK
LOW_HZ = 55.0
HIGH_HZ = 200.0


def document(clip: Clip) -> dict[str, Any]:
    """Return the JSON document."""
    times = [round(float(at), 3) for at in clip.times_s]
    amplitude = np.round(clip.points(), 4).tolist()
    frequency = relative_frequency(clip)
    return {
        "version": {"major": 1, "minor": 0, "patch": 0},
        "metadata": {
            "editor": f"HapticVLM {__version__}",
            "author": "",
            "source": "",
            "project": "",
            "tags": [clip.material, clip.interaction],
            "description": f"{clip.interaction} on {clip.material}",
        },
        "signals": {
            "continuous": {
                "envelopes": {
                    "amplitude": _points(times, "amplitude", amplitude),
                    "frequency": _points(times, "frequency", frequency),
                }
            }
        },
    }


def relative_frequency(clip: Clip) -> list[float]:
    """Frequency of each point, 0..1 from LOW_HZ to HIGH_HZ."""
    share = (clip.frequency_hz - LOW_HZ) / (HIGH_HZ - LOW_HZ)
    found: list[float] = np.round(np.clip(share, 0.0, 1.0), 4).tolist()
    return found


def _points(times: list[float], name: str, values: list[float]) -> list[dict[str, float]]:
    return [{"time": at, name: value} for at, value in zip(times, values, strict=True)]
