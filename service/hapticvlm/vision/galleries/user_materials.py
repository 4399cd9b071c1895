"""Reads and writes the user's materials: one small TOML file each, in a gallery folder.

    like = "wood"                     # the built-in class it is derived from
    words = ["walnut", "burr walnut"] # in names of objects; left out: the material's own name
    [thermal]                         # facts that differ from the class: see materials.LIMITS
    conductivity = 0.2
    [vibration]
    roughness = 0.4
    [references]                      # its embeddings by one encoder; may be left out
    encoder = "material-1"
    vectors = ["..."]                 # float16, little-endian, base64: one string each
    pictures = [4, 4, 3]              # how many of them come from each picture; left out: 4 each

The file's name is the material's. Its references join the user references of a gallery. Embeds no
picture.
"""

from __future__ import annotations

import base64
import binascii
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hapticvlm import documents
from hapticvlm.materials import MATERIALS, Material, MaterialError, derive

Floats = NDArray[np.float32]

MAX_USER_MATERIALS = 48  # the audio engine has tables ready for these and the built-in classes
MAX_FILE_BYTES = 16 * 1024 * 1024
_FIELDS = ("like", "words", "thermal", "vibration", "references")
VIEWS = 4  # references from each picture, if a file does not state it
SHORTEST = 0.5  # least norm of a reference; rounding to float16 leaves it near 1


@dataclass(frozen=True, slots=True, eq=False)
class UserMaterial:
    """One of the user's materials; references (N, D) float32 of unit norm, made with `encoder`.

    `pictures` holds how many consecutive references come from each picture.
    """

    material: Material
    like: str
    facts: Mapping[str, object] = field(default_factory=dict)
    encoder: str | None = None
    references: Floats = field(default_factory=lambda: np.zeros((0, 0), np.float32))
    pictures: tuple[int, ...] = ()


def table_with(user_materials: Sequence[UserMaterial]) -> Mapping[str, Material]:
    """Return the built-in table with these materials after it."""
    return {**MATERIALS, **{item.material.name: item.material for item in user_materials}}


def is_empty(path: Path | None) -> bool:
    """Whether this is a gallery folder without references: the shipped ones are used alone."""
    return bool(path and path.is_dir() and not [*path.glob("*.toml"), *path.glob("gallery.npz")])


def read_folder(folder: Path | None) -> tuple[UserMaterial, ...]:
    """Read every material of a gallery folder, by name; () for a path that is not a folder.

    Raises MaterialError.
    """
    if folder is None or not folder.is_dir():
        return ()
    paths = sorted(path for path in folder.glob("*.toml") if not path.name.startswith("."))
    if len(paths) > MAX_USER_MATERIALS:
        problem = (
            f"{folder} holds {len(paths)} materials; at most {MAX_USER_MATERIALS} are supported"
        )
        raise MaterialError(f"{problem}; move some to another folder")
    return tuple(read_material(path) for path in paths)


def read_material(path: Path) -> UserMaterial:
    """Read one file. Raises MaterialError naming file, field and cure."""
    try:
        return _parse(path.stem, documents.read_toml(path, dict[str, object], MAX_FILE_BYTES))
    except OSError as error:
        reason = error.strerror or str(error)
        raise MaterialError(f"{path}: cannot be read ({reason}); make it readable") from None
    except (ValueError, MaterialError) as error:
        raise MaterialError(f"{path}: {documents.reason(error)}") from None


def write_material(user_material: UserMaterial, folder: Path) -> Path:
    """Write a material's file into an existing folder atomically; return its path."""
    path = folder / f"{user_material.material.name}.toml"
    documents.replace_file(path, _text(user_material))
    return path


def _parse(name: str, table: Mapping[str, object]) -> UserMaterial:
    for key in table:
        if key not in _FIELDS:
            raise MaterialError(f"{key} is not a field; a material has {', '.join(_FIELDS)}")
    if "like" not in table:
        raise MaterialError(f"like: missing; add the class it resembles: {', '.join(MATERIALS)}")
    facts = {key: table[key] for key in ("thermal", "vibration") if key in table}
    like = str(table["like"])
    words = table.get("words")
    material = derive(name, like, words, facts)
    encoder, references = _references(table.get("references"))
    pictures = _pictures(table.get("references"), len(references))
    return UserMaterial(material, like, facts, encoder, references, pictures)


def _references(table: object) -> tuple[str | None, Floats]:
    if table is None:
        return None, np.zeros((0, 0), np.float32)
    if not isinstance(table, Mapping) or set(table) - {"pictures"} != {"encoder", "vectors"}:
        raise MaterialError("references: expected `encoder` and `vectors`; add the material again")
    vectors = table["vectors"]
    if not isinstance(vectors, list) or not vectors:
        raise MaterialError("references.vectors: expected a list of strings; add it again")
    try:
        rows = [np.frombuffer(base64.b64decode(v, validate=True), "<f2") for v in vectors]
        stack = np.stack(rows).astype(np.float32)
    except (binascii.Error, ValueError, TypeError):
        problem = "not float16 vectors of one length in base64"
        raise MaterialError(f"references.vectors: {problem}; add the material again") from None
    norms = np.linalg.norm(stack, axis=1, keepdims=True)
    if not np.isfinite(stack).all() or not (norms > SHORTEST).all():
        problem = "not all finite and of unit length"
        raise MaterialError(f"references.vectors: {problem}; add the material again")
    return str(table["encoder"]), np.asarray(stack / norms, np.float32)


def _pictures(table: object, count: int) -> tuple[int, ...]:
    """Read how many references come from each picture; VIEWS where it is not stated."""
    counts = table.get("pictures") if isinstance(table, Mapping) else None
    if counts is None:
        return (*([VIEWS] * (count // VIEWS)), *([count % VIEWS] if count % VIEWS else []))
    whole = isinstance(counts, list) and all(type(n) is int and n > 0 for n in counts)
    if not whole or sum(counts) != count:
        problem = f"expected counts of one or more that sum to the {count} vectors"
        raise MaterialError(f"references.pictures: {problem}; leave it out, or add it again")
    return tuple(counts)


def _text(user_material: UserMaterial) -> str:
    lines = [
        f"like = {json.dumps(user_material.like)}",
        f"words = {_value(list(user_material.material.words))}",
    ]
    for part, facts in user_material.facts.items():
        assert isinstance(facts, Mapping)
        lines += ["", f"[{part}]", *(f"{key} = {_value(value)}" for key, value in facts.items())]
    if user_material.encoder is not None:
        vectors = [base64.b64encode(row).decode() for row in user_material.references.astype("<f2")]
        lines += [
            "",
            "[references]",
            f"encoder = {json.dumps(user_material.encoder)}",
            "vectors = [",
        ]
        lines += [*(f'  "{vector}",' for vector in vectors), "]"]
        lines += (
            [f"pictures = {_value(list(user_material.pictures))}"] if user_material.pictures else []
        )
    return "\n".join(lines) + "\n"


def _value(value: object) -> str:
    """Write a number, a string, a list or a map of them as TOML."""
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{key} = {_value(item)}" for key, item in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(_value(item) for item in value) + "]"
    return json.dumps(value, ensure_ascii=False) if isinstance(value, str) else repr(value)
