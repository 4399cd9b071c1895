"""Opens a feel file of `hapticvlm bake`: checks it by its schema and decodes the clips.

A foreign or damaged file is refused with the field that is wrong, before anything is felt. The
limits of the schema leave no figure that could make a player loop for ever or use a device at full
strength.
"""

from __future__ import annotations

import base64
import itertools
import json
import re
from pathlib import Path
from typing import Any

import numpy as np

Json = dict[str, Any]
IMPACTS = ("tap", "strike", "press")
TEXTURES = ("slide", "carve", "swing")
SCHEMA = json.loads((Path(__file__).parents[1] / "schemas/feel_clips.schema.json").read_text())
KINDS: Json = {"object": dict, "array": list, "string": str, "number": (int, float), "integer": int}
SIZES = {"string": "Length", "array": "Items"}
SILENCE = {"peak": 0.0, "bytes": "/w=="}


def opened(file: Any) -> Json:  # noqa: ANN401
    """Check a parsed feel file and decode its clips. Raises ValueError, which names the field."""
    _check(file, SCHEMA, "", file)
    if not {"left", "right"} <= set(file["words"]["hand"]):
        raise ValueError("words.hand: lacks left or right; bake it again")
    for name, kind in itertools.product(file["materials"], IMPACTS):
        if (
            len({file["clips"][clip]["rate_hz"] for clip in file["materials"][name][kind]["clips"]})
            > 1
        ):
            raise ValueError(f"materials.{name}.{kind}.clips: have several rates; bake it again")
    feel: Json = {**file}
    for kind in ("clips", "loops"):
        feel[kind] = {name: _decoded(clip, f"{kind}.{name}") for name, clip in file[kind].items()}
    return feel


def _check(value: Any, schema: Json, name: str, file: Any) -> None:  # noqa: ANN401
    """Check a value by the part of the schema that describes it, and all that it contains."""
    if "anyOf" in schema and value is None:
        return
    schema = _described(schema)
    problem = _problem(value, schema, file)
    if problem:
        raise ValueError(f"{name or 'the file'}: {problem}; bake it again")
    parts: Any = ()
    if schema["type"] == "object":
        keys, others = [*schema.get("required", ()), *value], schema.get("additionalProperties")
        parts = schema.get("properties") or dict.fromkeys(keys, others)
    elif schema["type"] == "array":
        parts = dict(enumerate(schema.get("prefixItems") or [schema["items"]] * len(value)))
    for key in parts:
        field = f"{name}.{key}".lstrip(".")
        if isinstance(key, str) and key not in value:
            raise ValueError(f"{field}: is missing; bake it again")
        _check(value[key], parts[key], field, file)
    if schema.get("rises") and sorted(set(value)) != value:
        raise ValueError(f"{name}: does not rise; bake it again")


def _described(schema: Json) -> Json:
    """Return the part that describes a value that is not null, without references."""
    schema = schema.get("anyOf", [schema])[0]
    return SCHEMA["$defs"][schema["$ref"].rpartition("/")[2]] if "$ref" in schema else schema


def _problem(value: Any, schema: Json, file: Any) -> str | None:  # noqa: ANN401
    """Return what is wrong with a value itself."""
    kind = schema["type"]
    if not isinstance(value, KINDS[kind]) or isinstance(value, bool):
        return f"is not of type {kind}"
    if kind in ("string", "array"):
        least, most = schema.get(f"min{SIZES[kind]}", 0), schema.get(f"max{SIZES[kind]}", 1e9)
        if not least <= len(value) <= most:
            return f"has {len(value)} entries, not {least} or more"
    if kind == "string" and not re.search(schema.get("pattern", ""), value):
        return f"{value!r} does not match {schema['pattern']}"
    if "in" in schema and value not in file[schema["in"]]:
        return f"{schema['in']} has no {value!r}"
    if kind in ("number", "integer"):
        low, high = schema.get("minimum", -1e9), schema.get("maximum", 1e9)
        if not low <= value <= high:
            return f"{value!r} is not {low:g} to {high:g}"
    return None


def _decoded(clip: Json, name: str) -> Json:
    def codes(text: str, field: str) -> Any:  # noqa: ANN401
        try:
            return np.frombuffer(base64.b64decode(text, validate=True), np.uint8)
        except ValueError:
            raise ValueError(f"{name}.{field}: is not base64; bake it again") from None

    wave = codes(clip["wave"], "wave").view(np.int8) * (clip["peak"] / 127)
    decoded = {**clip, "wave": wave}
    if "gain" in clip:  # a loop; in the sound voice it has real and imaginary parts
        decoded["wave"] = wave[: wave.size // 2 * 2].view(np.complex128) if clip["body"] else wave
        decoded["loud"] = clip["loud"] or [1.0] * len(clip["rate"])
        decoded["body"] = clip["body"] or [0.0] * len(clip["rate"])
    else:
        decoded["hz"] = 20.0 * 10.0 ** (codes(clip["hz"], "hz") / 150.0)
    for field in ("drive",) if "gain" in clip else ("drive", "felt", "body"):
        track: Json = clip[field] or SILENCE
        steps = codes(track["bytes"], f"{field}.bytes")
        decoded[field] = np.where(steps == 255, 0.0, track["peak"] * 10.0 ** (steps / -40.0))
    return decoded
