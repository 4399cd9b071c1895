"""Writes `.haptic` 1.0 of Meta's Haptics SDK: envelopes of amplitude and frequency. Pure.

By the file format specification of facebook/meta-haptics-sdk (MIT). Times are in s. Amplitude is
0..1 of the actuator's full scale. Frequency is relative, 0..1, and the ends are those of the
actuator's own range, here of a Quest controller. The format has no heat. No emphasis is written:
the envelope already contains the impact, and an emphasis would be added to it.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hapticvlm import __version__
from hapticvlm.touches.clip import Clip

# The range of a Quest controller, from its ACF file in that SDK.
LOW_HZ = 55.0
HIGH_HZ = 200.0


def document(clip: Clip) -> dict[str, Any]:
    """Return the clip as a JSON document."""
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
    """Return the frequency of each point, 0 at LOW_HZ to 1 at HIGH_HZ, clipped."""
    share = (clip.frequency_hz - LOW_HZ) / (HIGH_HZ - LOW_HZ)
    relative: list[float] = np.round(np.clip(share, 0.0, 1.0), 4).tolist()
    return relative


def _points(times: list[float], name: str, values: list[float]) -> list[dict[str, float]]:
    return [{"time": at, name: value} for at, value in zip(times, values, strict=True)]
