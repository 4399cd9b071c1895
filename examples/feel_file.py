"""Opens a feel file of `hapticvlm bake`: checks every number and decodes the clips.

A foreign or damaged file is refused with the field that is wrong, before anything is felt. The
limits leave no figure that could make a player loop for ever or use a device at full strength.
"""

from __future__ import annotations

import base64
from typing import Any

import numpy as np

Json = dict[str, Any]
IMPACTS = ("tap", "strike", "press")
VOICES = ("true", "sound")
# Each number of a file and its limits. [s] is a list by speed, [f] by force, [] of any length; * is
# each entry of a map. A field that ends in ? may be null.
LIMITS = {
    "version": (2, 2),
    "speeds_mps.[s]": (0, 1000),
    "forces_n.[f]": (0, 1e4),
    "ranges.*.[]": (-1e6, 1e6),
    "rules.lease_s": (0.01, 10),
    "rules.step_s": (0.001, 0.02),
    "rules.fade_s": (0.001, 1),
    "rules.smooth_s": (0.001, 1),
    "rules.ceiling": (0.01, 1),
    "rules.recover_s": (0.001, 10),
    "rules.max_impacts": (1, 64),
    "rules.max_ringing": (1, 64),
    "rules.max_textures": (0, 64),
    "rules.pitch_varies": (0, 0.5),
    "rules.grain_strength": (0, 10),
    "rules.grains_per_s": (1, 1000),
    "rules.grain_back": (0, 10),
    "rules.pad.horizon_s": (0.01, 1),
    "rules.pad.period_s.*": (0.0025, 0.1),
    "rules.pad.scale.*": (0, 100),
    "rules.pad.exponent": (0.01, 10),
    "rules.pad.min_level": (0, 1),
    "rules.pad.min_impact": (0, 1),
    "rules.pad.min_impact_s": (0, 1),
    "rules.pad.min_amplitude": (0, 1),
    "rules.pad.hum_hz.[]": (1, 1e4),
    "rules.pad.hum_felt.[]": (0, 100),
    "rules.sound?.level": (0, 10),
    "rules.sound?.exponent": (0, 1),
    "rules.sound?.lowest": (1e-6, 1),
    "rules.sound?.fall_per_s": (0, 100),
    "rules.sound?.times": (0, 16),
    "rules.sound?.shift_hz": (0, 1e4),
    "rules.sound?.hum_weight.[]": (0, 100),
    "impacts.*.contact_s.[s].[f]": (1e-4, 1),
    "impacts.*.palm.[s].[f]": (0, 100),
    "impacts.*.pad.[s].[f]": (0, 100),
    "materials.*.hz": (1, 1e4),
    "materials.*.n_per_grain?": (1e-3, 1e6),
    "materials.*.slide.layers.[].level.[s].[f]": (0, 100),
    "materials.*.swing.layers.[].level.[s].[f]": (0, 100),
    "materials.*.swing.thickness_m": (1e-4, 100),
    "materials.*.carve.layers?.[].level.[s].[f]": (0, 100),
    "materials.*.carve.factor": (0, 10),
    "materials.*.carve.level?.[s].[f]": (0, 100),
    "materials.*.carve.per_s?.[s]": (0, 1000),
    "clips.*.rate_hz": (100, 96000),
    "clips.*.peak": (0, 1000),
    "clips.*.most": (0, 1e4),
    "clips.*.drive.peak": (0, 1000),
    "clips.*.felt.peak": (0, 1000),
    "clips.*.body?.peak": (0, 1000),
    "loops.*.rate_hz": (100, 96000),
    "loops.*.peak": (0, 1000),
    "loops.*.drive.peak": (0, 1000),
    "loops.*.body?.peak": (0, 1000),
    "loops.*.gain.[s]": (0, 100),
    "loops.*.rate.[s]": (0.001, 100),
    "loops.*.wave_rate.[s]": (0.001, 100),
    "loops.*.felt.[s]": (0, 100),
    "loops.*.hz.[s]": (1, 1e4),
} | {
    f"materials.*.{kind}.{field}": limits
    for kind in IMPACTS
    for field, limits in (("contact_s.[]", (1e-4, 1)), ("palm", (0, 1000)), ("pad", (0, 1000)))
}


def opened(file: Any) -> Json:  # noqa: ANN401
    """Check a parsed feel file and decode its clips. Raises ValueError, which names the field."""
    for path, (low, high) in LIMITS.items():
        _check(file, path.split("."), "", file, low, high)
    if file.get("voice") not in VOICES:
        raise ValueError(f"voice: {file.get('voice')!r} is not true or sound; bake it again")
    _check_lists(file)
    feel: Json = {**file, "clips": {}, "loops": {}}
    for kind in ("clips", "loops"):
        for name, clip in file[kind].items():
            feel[kind][name] = _decoded(clip, f"{kind}.{name}", is_loop=kind == "loops")
    _check_names(file)
    return feel


def _check_lists(file: Json) -> None:
    for name in ("phase", "hand", "interaction"):
        words = file.get("words", {}).get(name)
        if not isinstance(words, list) or not all(isinstance(word, str) for word in words):
            raise ValueError(f"words.{name}: is not a list of words; bake it again")
    for axis in ("speeds_mps", "forces_n"):
        if sorted(set(file[axis])) != file[axis]:
            raise ValueError(f"{axis}: does not rise; bake it again")


def _check_names(file: Json) -> None:
    for name, facts in file["materials"].items():
        layers = (
            facts["slide"]["layers"] + facts["swing"]["layers"] + (facts["carve"]["layers"] or [])
        )
        names = [("loops", layer.get("loop")) for layer in layers] + [("clips", facts.get("grain"))]
        names += [("clips", clip) for kind in IMPACTS for clip in facts[kind].get("clips", ())]
        for kind in IMPACTS:
            if len(facts[kind]["contact_s"]) != len(facts[kind].get("clips", ())):
                raise ValueError(
                    f"materials.{name}.{kind}.clips: not as many as contact_s; bake it again"
                )
        for kind, clip in names:
            if clip not in file[kind]:
                raise ValueError(f"materials.{name}: {kind} has no {clip!r}; bake it again")


def _check(
    value: Any,  # noqa: ANN401
    path: list[str],
    name: str,
    file: Json,
    low: float,
    high: float,
) -> None:
    if not path:
        _check_number(value, name[1:], low, high)
        return
    key, rest = path[0].rstrip("?"), path[1:]
    if key.startswith("["):
        wanted = {"[s]": "speeds_mps", "[f]": "forces_n"}.get(key)
        size = len(file[wanted]) if wanted and name[1:] != wanted else None
        if not isinstance(value, list) or not value or size not in (None, len(value)):
            raise ValueError(
                f"{name[1:]}: is not a list of {size or 'some'} entries; bake it again"
            )
        parts = [(f"{name}.{at}", one) for at, one in enumerate(value)]
    elif not isinstance(value, dict):
        raise ValueError(f"{name[1:] or 'the file'}: is not a map; bake it again")
    elif key not in ("*", *value):
        raise ValueError(f"{name[1:]}.{key}: is missing; bake it again".lstrip("."))
    else:
        parts = [(f"{name}.{at}", value[at]) for at in (value if key == "*" else [key])]
    for name, one in parts:
        if not (one is None and path[0].endswith("?")):
            _check(one, rest, name, file, low, high)


def _check_number(value: Any, name: str, low: float, high: float) -> None:  # noqa: ANN401
    is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
    if not (is_number and low <= value <= high):
        raise ValueError(f"{name}: {value!r} is not {low:g} to {high:g}; bake it again")


def _decoded(clip: Json, name: str, *, is_loop: bool) -> Json:
    def data(text: Any, field: str) -> bytes:  # noqa: ANN401
        try:
            decoded = base64.b64decode(text, validate=True)
        except (ValueError, TypeError):
            decoded = b""
        if not decoded:
            raise ValueError(f"{name}.{field}: is not base64, or empty; bake it again")
        return decoded

    decoded = {
        **clip,
        "wave": np.frombuffer(data(clip.get("wave"), "wave"), np.int8) * (clip["peak"] / 127),
    }
    for field in ("drive", "felt", "body"):
        if isinstance(clip.get(field), dict):  # a loop has the loudness by speed
            codes = np.frombuffer(
                data(clip[field].get("bytes"), f"{field}.bytes"), np.uint8
            ).astype(float)
            decoded[field] = np.where(
                codes == 255, 0.0, clip[field]["peak"] * 10.0 ** (-codes / 40.0)
            )
    if not is_loop:
        decoded["hz"] = 20.0 * 10.0 ** (np.frombuffer(data(clip.get("hz"), "hz"), np.uint8) / 150.0)
    return decoded
