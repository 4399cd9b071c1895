"""Writes `.hjif` of MPEG haptics (ISO/IEC 23090-31): vibration and temperature of a touch. Pure.

Field names and rules are those of MPEGGroup/HapticReferenceSoftware, whose JSON schema is not
public. The vibration is one tone for each octave, in a band of its own. Positions are in ticks of
1 ms, frequencies in Hz. The amplitude of a keyframe times the gain of its channel is 0..1 of full
scale. This is the only export with heat: the Main profile has a modality for temperature. Its scale
is not fixed by the format, so the description of the perception states it: setpoint = NEUTRAL_C +
SPAN_C value, where the value includes the gain.

The binary form of the format has two rules that its text form does not need. The ids of channels
are unique in the whole document, or its decoder aborts. An amplitude of a keyframe has 8 bits, so
the largest of a channel is 1 and the channel's gain holds the peak.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from hapticvlm.perception import NEUTRAL_C
from hapticvlm.touches.clip import Band, Clip

TICKS_PER_S = 1000
LOW_HZ = 1
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
    tones = clip.bands()
    levels, gain = _normalised(np.array([tone.levels for tone in tones]))
    at = [round(at * TICKS_PER_S) for at in clip.times_s.tolist()]
    bands = [
        _tone(tone, at, points, KEYWORDS.get(clip.material))
        for tone, points in zip(tones, levels, strict=True)
    ]
    description = "vibration of the palm, 1 is full scale"
    return _perception(0, "Vibrotactile", description, bands, gain)


def _tone(tone: Band, at: list[int], levels: list[float], keyword: str | None) -> dict[str, Any]:
    keyframes = [
        {
            "relative_position": tick,
            "amplitude_modulation": level,
            "frequency_modulation": round(hertz),
        }
        for tick, level, hertz in zip(at, levels, tone.frequency_hz.tolist(), strict=True)
    ]
    return {
        "band_type": "VectorialWave",
        "lower_frequency_limit": tone.low_hz,
        "upper_frequency_limit": tone.high_hz,
        "effects": [_effect(keyframes, keyword)],
    }


def _temperature(clip: Clip) -> dict[str, Any]:
    heat = clip.heat
    end_s = float(clip.times_s[-1])
    count = max(round(end_s / HEAT_STEP_S), 2)  # the decoder renders two keyframes as silence
    at_s = np.linspace(0.0, end_s, count + 1)
    plate_c = np.interp(at_s, heat.time_s, heat.setpoint_c)
    (levels,), gain = _normalised((plate_c - NEUTRAL_C)[None] / SPAN_C)
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
    return _perception(1, "Temperature", description, [band], gain)


def _normalised(values: NDArray[np.float64]) -> tuple[list[list[float]], float]:
    """Return the values, (bands, points), divided by their largest size, and that size: the gain.

    Where all are 0, the gain is 1.
    """
    peak = float(np.abs(values).max()) or 1.0
    rows = (values / peak).tolist()
    return [[round(value, 4) for value in row] for row in rows], peak


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
    number: int, modality: str, description: str, bands: list[dict[str, Any]], gain: float
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
                "bands": bands,
            }
        ],
    }
