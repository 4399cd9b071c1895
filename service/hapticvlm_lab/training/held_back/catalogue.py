"""The sources of the held-back renders: textures, models, skies and measured values.

Lists the data folder through labels.csv and takes only entries that `training.sources` holds back
and whose licence and origin can be stated. Independent of any renderer.
"""

from __future__ import annotations

import csv
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hapticvlm import materials
from hapticvlm_lab.training import sources

LICENCES = frozenset({"CC0-1.0", "MIT-0", "MIT"})
_NO_ORIGIN = "origin not stated"  # note of textures whose licence cannot be vouched for
_ATLAS = "object atlas"  # note of textures that fit one model alone

Row = Mapping[str, str]


class CatalogueError(ValueError):
    """Raised when the data folder lacks a source; the text names it and where it was searched."""


@dataclass(frozen=True, slots=True)
class Texture:
    """A tileable surface: its material, kind (labels.csv's subclass) and the maps it has."""

    name: str
    material: str
    kind: str
    maps: Mapping[str, Path]
    licence: str
    metallic: float | None = None


@dataclass(frozen=True, slots=True)
class Model:
    """A furnishing with its own texture: a .glb or .gltf file; `z_up` as its source had it."""

    name: str
    material: str
    path: Path
    licence: str
    z_up: bool


@dataclass(frozen=True, slots=True)
class Catalogue:
    """Sources of surfaces; values maps a substance to its measured linear colour or (n, k)."""

    textures: Mapping[str, tuple[Texture, ...]]
    models: Mapping[str, Model]
    skies: tuple[Path, ...]
    values: Mapping[str, Mapping[str, Any]]


def read_catalogue(data: Path, *, teaches: bool = False) -> Catalogue:
    """Read labels.csv and pb_renders/values.json: what is held back, or what may teach.

    Raises CatalogueError.
    """
    try:
        with (data / "labels.csv").open(newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        values = json.loads((data / "pb_renders" / "values.json").read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise CatalogueError(
            f"{data} is not a data folder with labels.csv and pb_renders/values.json: {error}"
        ) from None
    skies = [data / row["path"] for row in rows if is_sky(row, teaches=teaches)]
    models = {model.name: model for model in (_model(data, row) for row in rows if is_model(row))}
    if teaches:
        models = {}
    return Catalogue(
        _by_material(_texture(data, row) for row in rows if is_texture(row, teaches=teaches)),
        models,
        tuple(skies),
        {entry["name"]: _measured(entry) for entry in values["data"]},
    )


def is_texture(row: Row, *, teaches: bool = False) -> bool:
    """Return whether a row is a held-back (or teaching), tileable texture of stated origin."""
    source = row["path"].split("/")[0]
    if row["licence"] not in LICENCES or _NO_ORIGIN in row["note"] or _ATLAS in row["note"]:
        return False
    if source == "pbr":
        return (source in sources.HELD_BACK) != teaches
    return source == "ambientcg_tiles" and sources.is_tile_held_back(row["path"]) != teaches


def is_model(row: Row) -> bool:
    """Return whether a row of labels.csv is a held-back model free of conditions (CC0 or MIT-0)."""
    source = row["path"].split("/")[0]
    free = row["licence"] in LICENCES - {"MIT"}
    return source == "models" and source in sources.HELD_BACK and free


def is_sky(row: Row, *, teaches: bool = False) -> bool:
    """Return whether a row of labels.csv is a held-back (or teaching) environment map."""
    source, _, file = row["path"].partition("/")
    name = file.removesuffix(".hdr").removesuffix("_512")
    return source == "hdri" and (name in sources.HDRI_HELD_BACK) != teaches


def _texture(data: Path, row: Row) -> Texture:
    albedo = data / row["path"]
    material = sources.material_of(row["class"])
    metallic = None
    maps = {"albedo": albedo}
    name = albedo.stem
    if row["path"].startswith("pbr/"):
        about = json.loads((albedo.parent / "material.json").read_text(encoding="utf-8"))
        maps = {kind: albedo.parent / file for kind, file in about["maps"].items()}
        metallic = about.get("metallic")
        name = albedo.parent.name
    return Texture(name, material, row["subclass"], maps, row["licence"], metallic)


def _model(data: Path, row: Row) -> Model:
    path = data / row["path"]
    name = path.stem.removesuffix("_1k")
    z_up = row["source"].startswith("aws-robotics")
    return Model(name, sources.material_of(row["class"]), path, row["licence"], z_up)


def _by_material(textures: Iterable[Texture]) -> dict[str, tuple[Texture, ...]]:
    grouped: dict[str, tuple[Texture, ...]] = {}
    for texture in textures:
        if texture.material != materials.UNKNOWN:
            grouped[texture.material] = (*grouped.get(texture.material, ()), texture)
    return grouped


def _measured(entry: Mapping[str, Any]) -> dict[str, Any]:
    """Return linear sRGB colour, complex index and index of refraction, if they were measured."""
    measured: dict[str, Any] = {}
    for key in ("color", "complexIor"):
        for value in entry.get(key) or []:
            if value.get("colorSpace") == "srgb-linear":
                measured[key] = value
    if entry.get("ior"):
        measured["ior"] = entry["ior"]
    return measured
