"""Writes `.hjif` of MPEG haptics (ISO/IEC 23090-31): vibration and temperature of a touch. Pure.

Field names and rules are those of MPEGGroup/HapticReferenceSoftware, whose JSON schema is not
public. Positions are in ticks of 1 ms, frequencies in Hz. The amplitude of a keyframe times the
gain of its channel is 0..1 of full scale. This is the only export with heat: the Main profile has a
modality for temperature. Its scale is not fixed by the format, so the description of the perception
states it: setpoint = NEUTRAL_C + SPAN_C value, where the value includes the gain.

The binary form of the format has two rules that its text form does not need. The ids of channels
are unique in the whole document, or its decoder aborts. An amplitude of a keyframe has 8 bits, so
the largest of a channel is 1 and the channel's gain holds the peak.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from hapticvlm.perception import NEUTRAL_C
from hapticvlm_studio.touches.clip import Clip

TICKS_PER_S = 1000
LOW_HZ = 1
HIGH_HZ = 1000
SPAN_C = 16.0  # degC from neutral at a value of 1; wider than the limits of the setpoint
HEAT_STEP_S = 0.1
KEYWORDS = {  # from the format's list, which has neither glass nor fabric
    "wood": "Texture/Wood",
    "metal": "Texture/Metal",
    "stone": "Texture/Rock",
    "plastic": "Texture/Plastic",
}
_UNSPECIFIED = 0  # of an avatar and of a body part


def document(clip: Clip, date: str) -> dict[str, Any]:
    """Return the clip as a JSON document; `date` is of ISO 8601."""
    return {
        "version": "2023",
        "profile": "Main",
        "level": 1,
        "date": date,
        "description": f"{clip.interaction} on {clip.material}, by HapticVLM",
        "timescale": TICKS_PER_S,
        "avatars": [],
        "perceptions": [_vibration(clip), _temperature(clip)],
        "syncs": [],
    }


def _vibration(clip: Clip) -> dict[str, Any]:
    levels, gain = _normalised(clip.points())
    keyframes = [
        {
            "relative_position": round(at * TICKS_PER_S),
            "amplitude_modulation": level,
            "frequency_modulation": round(float(hertz)),
        }
        for at, level, hertz in zip(clip.times_s.tolist(), levels, clip.frequency_hz, strict=True)
    ]
    band = {
        "band_type": "VectorialWave",
        "lower_frequency_limit": LOW_HZ,
        "upper_frequency_limit": HIGH_HZ,
        "effects": [_effect(keyframes, KEYWORDS.get(clip.material))],
    }
    description = "vibration of the palm, 1 is full scale"
    return _perception(0, "Vibrotactile", description, band, gain)


def _temperature(clip: Clip) -> dict[str, Any]:
    heat = clip.heat
    end_s = float(clip.times_s[-1])
    count = max(round(end_s / HEAT_STEP_S), 2)  # the decoder renders two keyframes as silence
    at_s = np.linspace(0.0, end_s, count + 1)
    plate_c = np.interp(at_s, heat.time_s, heat.setpoint_c)
    levels, gain = _normalised((plate_c - NEUTRAL_C) / SPAN_C)
    keyframes = [
        {
            "relative_position": round(at * TICKS_PER_S),
            "amplitude_modulation": level,
        }
        for at, level in zip(at_s.tolist(), levels, strict=True)
    ]
    band = {
        "band_type": "Curve",
        "curve_type": "Linear",
        "lower_frequency_limit": 0,
        "upper_frequency_limit": LOW_HZ,
        "effects": [_effect(keyframes, None)],
    }
    scale = f"{NEUTRAL_C:g} + {SPAN_C:g} x value"
    description = f"setpoint of the plate, degC = {scale}; value = keyframe x gain"
    return _perception(1, "Temperature", description, band, gain)


def _normalised(values: NDArray[np.float64]) -> tuple[list[float], float]:
    """Return the values divided by their largest size, and that size: the gain, at least 0."""
    peak = float(np.abs(values).max())
    if peak == 0.0:
        return [0.0] * values.size, 1.0
    return [round(value, 4) for value in (values / peak).tolist()], peak


def _effect(keyframes: list[dict[str, Any]], keyword: str | None) -> dict[str, Any]:
    effect = {
        "effect_type": "Basis",
        "position": 0,
        "phase": 0.0,
        "base_signal": "Sine",
        "keyframes": keyframes,
    }
    return effect if keyword is None else {**effect, "semantic_keywords": keyword}


def _perception(
    number: int, modality: str, description: str, band: dict[str, Any], gain: float
) -> dict[str, Any]:
    return {
        "id": number,
        "avatar_id": _UNSPECIFIED,
        "description": description,
        "perception_modality": modality,
        "unit_exponent": -3,
        "perception_unit_exponent": 0,
        "reference_devices": [],
        "effect_library": [],
        "channels": [
            {
                "id": number,
                "description": "palm",
                "gain": gain,
                "mixing_coefficient": 1.0,
                "body_part_mask": _UNSPECIFIED,
                "bands": [band],
            }
        ],
    }
