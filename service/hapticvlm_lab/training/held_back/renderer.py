"""Renders a stage with Mitsuba 3: linear pictures and the object's masks.

Uses LLVM on one thread if libLLVM 19 is found, the scalar variant otherwise. All cameras of a stage
are one "batch" sensor, so that there is one launch.

Mitsuba compiles a kernel for each form of surface, and surfaces of one form share its code; so a
scene compiles and runs in a third of the time if all opaque surfaces have one form. Therefore every
opaque surface has all inputs as maps, a map's repeats are in the mesh's uv, and a relief's depth is
in its heights: a transform or a scale would be compiled in. Independent of the material classes.
"""

from __future__ import annotations

import ctypes.util
import os
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hapticvlm_lab.training.held_back.cameras import Camera
from hapticvlm_lab.training.held_back.meshes import write_ply
from hapticvlm_lab.training.held_back.stage import Stage, Thing
from hapticvlm_lab.training.held_back.surfaces import (
    Clear,
    Conductor,
    Glowing,
    Map,
    Opaque,
    Relief,
    Surface,
    to_linear,
)

OVERSAMPLING = 2  # film pixels a picture pixel, per axis
HALVES = 2  # a picture is rendered twice, to estimate its noise
MASK_SAMPLES = 4
DEPTH = 10  # of a path: a goblet has two walls before and two behind its inside
_NEARLY_NONE = 1e-4
_FLAT = np.zeros((2, 2), np.float32)
LLVM = "llvm_ad_rgb"
SCALAR = "scalar_rgb"

Dict = dict[str, Any]
Linear = NDArray[np.float32]


def start(variant: str | None = None, threads: int = 1) -> str:
    """Choose Mitsuba's variant, by default the fastest that this machine has; return its name."""
    library = ctypes.util.find_library("LLVM-19")
    if library is not None:
        os.environ.setdefault("DRJIT_LIBLLVM_PATH", library)
    import drjit
    import mitsuba

    has_llvm = "DRJIT_LIBLLVM_PATH" in os.environ
    chosen = variant or (LLVM if has_llvm else SCALAR)
    mitsuba.set_variant(chosen)
    mitsuba.set_log_level(mitsuba.LogLevel.Error)
    drjit.set_thread_count(threads)
    return chosen


def render(stage: Stage, side: int, samples: int, seed: int) -> tuple[Linear, Linear]:
    """Render all cameras, `samples` a film pixel and half.

    Returns radiance (HALVES, N, s, s, 3) linear with s = side * OVERSAMPLING, and the share of
    each picture pixel that is object, (N, side, side) 0..1.
    """
    import mitsuba

    film = side * OVERSAMPLING
    with TemporaryDirectory() as folder:
        files = _write_meshes(stage, Path(folder))
        scene: Any = mitsuba.load_dict(_scene(stage, files, _batch(stage.cameras, film, samples)))
        flat: Any = mitsuba.load_dict(
            _silhouette(stage, files, _batch(stage.cameras, side, MASK_SAMPLES))
        )
    halves = [
        np.array(mitsuba.render(scene, spp=samples, seed=seed + half), np.float32)  # type: ignore[arg-type]
        for half in range(HALVES)
    ]
    mask = np.array(mitsuba.render(flat, spp=MASK_SAMPLES), np.float32)
    pictures = np.stack([_apart(half[..., :3], film) for half in halves])
    return pictures, _apart(mask[..., 3:4], side)[..., 0]


def _apart(strip: Linear, side: int) -> Linear:
    """Cut a strip (side, N side, C) into (N, side, side, C)."""
    return np.stack(np.split(np.nan_to_num(strip), strip.shape[1] // side, axis=1))


def _write_meshes(stage: Stage, folder: Path) -> list[Path]:
    files = []
    for number, thing in enumerate((*stage.target, *stage.around)):
        files.append(folder / f"{number}.ply")
        write_ply(replace(thing.mesh, uv=thing.mesh.uv * _repeat(thing.surface)), files[-1])
    return files


def _repeat(surface: Surface) -> float:
    return 1.0 if isinstance(surface, Glowing) else surface.repeat


def _scene(stage: Stage, files: list[Path], sensor: Dict) -> Dict:
    import mitsuba

    turn = mitsuba.ScalarTransform4f().rotate([0, 1, 0], stage.light_turn)
    light = {"type": "envmap", "bitmap": mitsuba.Bitmap(stage.light), "to_world": turn}
    scene: Dict = {"type": "scene", "sensor": sensor, "light": light}
    scene["integrator"] = {"type": "path", "max_depth": DEPTH}
    glow = float(stage.light.mean())
    for number, thing in enumerate((*stage.target, *stage.around)):
        scene[f"thing{number}"] = _shape(thing, files[number], glow)
    return scene


def _silhouette(stage: Stage, files: list[Path], sensor: Dict) -> Dict:
    """Return a scene of a white object in black: the albedo of the first hit is the mask."""
    scene: Dict = {"type": "scene", "sensor": sensor}
    scene["integrator"] = {"type": "aov", "aovs": "albedo:albedo", "image": {"type": "direct"}}
    for number, file in enumerate(files):
        white = {"type": "diffuse", "reflectance": float(number < len(stage.target))}
        shape = {"type": "ply", "filename": str(file)}
        scene[f"thing{number}"] = {**shape, "bsdf": {"type": "twosided", "bsdf": white}}
    return scene


def _batch(cameras: tuple[Camera, ...], side: int, samples: int) -> Dict:
    import mitsuba

    sensor: Dict = {"type": "batch", "film": _film(side * len(cameras), side)}
    sensor["sampler"] = {"type": "multijitter", "sample_count": samples}
    for number, camera in enumerate(cameras):
        place = mitsuba.ScalarTransform4f().look_at(
            camera.eye.tolist(), camera.target.tolist(), [0, 1, 0]
        )
        sensor[f"view{number}"] = {
            "type": "perspective",
            "fov": camera.fov,
            "to_world": place,
            "film": _film(side, side),
            "near_clip": 0.01,
        }
    return sensor


def _film(width: int, height: int) -> Dict:
    return {
        "type": "hdrfilm",
        "width": width,
        "height": height,
        "pixel_format": "rgb",
        "rfilter": {"type": "box"},
    }


def _shape(thing: Thing, file: Path, glow: float) -> Dict:
    shape: Dict = {"type": "ply", "filename": str(file)}
    if isinstance(thing.surface, Glowing):
        radiance = [4 * glow * channel for channel in thing.surface.colour]
        emitter = {"type": "area", "radiance": {"type": "rgb", "value": radiance}}
        return {**shape, "emitter": emitter, "bsdf": {"type": "diffuse", "reflectance": 0.0}}
    return {**shape, "bsdf": _bsdf(thing.surface, closed=thing.mesh.closed)}


def _bsdf(surface: Surface, *, closed: bool) -> Dict:
    match surface:
        case Opaque():
            return {"type": "twosided", "bsdf": _raised(_opaque(surface), surface)}
        case Conductor():
            return {"type": "twosided", "bsdf": _raised(_conductor(surface), surface)}
        case Clear():
            clear = _clear(surface, closed=closed)
            return _raised(clear, surface) if surface.relief else clear
        case Glowing():
            return {"type": "diffuse", "reflectance": 0.0}


def _opaque(surface: Opaque) -> Dict:
    return {
        "type": "principled",
        "base_color": _colour(surface.colour),
        "roughness": _plane(surface.roughness),
        "metallic": _plane(surface.metallic),
        "specular": surface.specular,
        "clearcoat": max(surface.coat, _NEARLY_NONE),
        "clearcoat_gloss": 0.95,
        "sheen": max(surface.sheen, _NEARLY_NONE),
    }


def _conductor(surface: Conductor) -> Dict:
    return {
        "type": "roughconductor",
        "distribution": "ggx",
        "eta": {"type": "rgb", "value": list(surface.eta)},
        "k": {"type": "rgb", "value": list(surface.k)},
        "alpha_u": surface.rough_u,
        "alpha_v": surface.rough_v,
    }


def _clear(surface: Clear, *, closed: bool) -> Dict:
    kind = "roughdielectric" if surface.roughness else "dielectric"
    glass: Dict = {"type": kind if closed else "thindielectric", "int_ior": surface.ior}
    if surface.roughness and closed:
        glass["alpha"] = surface.roughness
    glass["specular_transmittance"] = {"type": "rgb", "value": list(surface.tint)}
    return glass


def _raised(bsdf: Dict, surface: Opaque | Conductor | Clear) -> Dict:
    relief = surface.relief or Relief(height=_FLAT, depth=0.0)
    heights = _bitmap(relief.depth * relief.height[..., None])
    return {"type": "bumpmap", "arbitrary": heights, "bsdf": bsdf}


def _colour(colour: Map | tuple[float, float, float]) -> Dict:
    if isinstance(colour, tuple):
        return _bitmap(np.broadcast_to(np.array(colour), (2, 2, 3)))
    return _bitmap(to_linear(colour))


def _plane(values: Map | float) -> Dict:
    plane = values if isinstance(values, np.ndarray) else np.full_like(_FLAT, values)
    return _bitmap(plane[..., None])


def _bitmap(values: NDArray[np.floating]) -> Dict:
    import mitsuba

    bitmap = mitsuba.Bitmap(np.ascontiguousarray(values, np.float32))
    return {"type": "bitmap", "bitmap": bitmap, "raw": True}
