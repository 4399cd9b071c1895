"""Sets the scene round an object: its parts, a table, things behind it, a wall, the light.

The surroundings are drawn alike for every material. Independent of any renderer.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from hapticvlm import materials
from hapticvlm_lab.training.held_back import classes, further, rooms, shapes, unknowns
from hapticvlm_lab.training.held_back.cameras import Camera, approach, direction, orbit
from hapticvlm_lab.training.held_back.catalogue import Catalogue
from hapticvlm_lab.training.held_back.gltf import Part, read_model
from hapticvlm_lab.training.held_back.meshes import (
    Array,
    Mesh,
    box_mapped,
    fitted,
    join,
    moved,
    rotation,
    sheet,
)
from hapticvlm_lab.training.held_back.plan import ORBIT_FRAMES, Plan
from hapticvlm_lab.training.held_back.surfaces import (
    Clear,
    Map,
    Opaque,
    Rng,
    Surface,
    any_colour,
    dressed,
)

_RECIPES = {**classes.RECIPES, **further.RECIPES}
_Y = np.eye(3)[1]


@dataclass(frozen=True, slots=True)
class Thing:
    """A mesh with its surface."""

    mesh: Mesh
    surface: Surface


@dataclass(frozen=True, slots=True)
class Stage:
    """The object, its surroundings, the light (H, W, 3) linear and its turn in degrees."""

    target: tuple[Thing, ...]
    around: tuple[Thing, ...]
    light: Map
    light_turn: float
    cameras: tuple[Camera, ...]
    surroundings: str


def seed_of(object_id: str) -> int:
    """Return the seed of an object."""
    return crc32(object_id.encode())


def set_stage(plan: Plan, catalogue: Catalogue, *, circling: bool) -> Stage:
    """Build everything of one object, from its id alone."""
    rng = np.random.default_rng(seed_of(plan.object_id))
    target = _target(plan, catalogue, rng)
    points = np.concatenate([thing.mesh.points for thing in target])
    cameras = orbit(points, rng, ORBIT_FRAMES) if circling else approach(points, rng)
    away = -np.mean([camera.eye for camera in cameras], axis=0)
    light, name = _light(catalogue, rng)
    around = [_table(catalogue, rng), *_clutter(catalogue, rng, points, away)]
    if rng.random() < 0.35:
        around.append(_wall(catalogue, rng, away))
    return Stage(target, tuple(around), light, rng.uniform(0, 360), tuple(cameras), name)


def draw(truth: str, number: int, rng: Rng, catalogue: Catalogue) -> Surface:
    """Draw a surface of a class, or the unknown surface of a number."""
    if truth == materials.UNKNOWN:
        return unknowns.draw(number, rng, catalogue)
    recipes = _RECIPES[truth]
    return recipes[number % len(recipes)](rng, catalogue)


def _target(plan: Plan, catalogue: Catalogue, rng: Rng) -> tuple[Thing, ...]:
    if plan.own:
        return _as_it_came(plan, catalogue, rng)
    if plan.shape == "leaves":
        return (Thing(shapes.make(plan.shape, rng), further.leaf(rng, catalogue)),)
    if plan.is_model:
        mesh = box_mapped(join([part.mesh for part in _model(plan.shape, catalogue, rng)]))
    else:
        mesh = shapes.make(plan.shape, rng)
    return (_dress(mesh, draw(plan.truth, plan.number, rng, catalogue)),)


def _dress(mesh: Mesh, surface: Surface) -> Thing:
    """Put a surface on a mesh; glass on a sheet, which has no inside, becomes a clear pane."""
    if isinstance(surface, Clear) and not mesh.closed:
        surface = replace(surface, roughness=0.0, relief=None)
    return Thing(mesh, surface)


def _model(name: str, catalogue: Catalogue, rng: Rng) -> list[Part]:
    model = catalogue.models[name]
    parts = read_model(model.path, z_up=model.z_up)
    turn = rotation(_Y, rng.uniform(0, 2 * np.pi))
    meshes = fitted([moved(part.mesh, turn, np.zeros(3)) for part in parts])
    return [replace(part, mesh=mesh) for part, mesh in zip(parts, meshes, strict=True)]


def _as_it_came(plan: Plan, catalogue: Catalogue, rng: Rng) -> tuple[Thing, ...]:
    things = []
    for part in _model(plan.shape, catalogue, rng):
        rough = part.roughness
        metallic = part.metallic
        surface = Opaque(
            made_of=f"model: {plan.shape}",
            colour=(0.5, 0.5, 0.5) if part.colour is None else _unit(part.colour),
            roughness=rough
            if part.metal_rough is None
            else _unit(part.metal_rough)[..., 1] * rough,
            metallic=(
                metallic if part.metal_rough is None else _unit(part.metal_rough)[..., 2] * metallic
            ),
            sheen=0.4 if plan.truth == "fabric" else 0.0,
            coat=1.0 if plan.truth == "ceramic" else 0.0,
        )
        things.append(Thing(part.mesh, surface))
    return tuple(things)


def _unit(picture: NDArray[np.uint8]) -> Map:
    return picture.astype(np.float32) / np.float32(255)


def _light(catalogue: Catalogue, rng: Rng) -> tuple[Map, str]:
    if rng.random() < 0.5:
        return rooms.draw_room(rng, catalogue), "room"
    path = catalogue.skies[int(rng.integers(len(catalogue.skies)))]
    return rooms.read_sky(path), path.stem


def _backdrop(catalogue: Catalogue, rng: Rng) -> Opaque:
    """Draw a table top or a wall: paint, or a texture of any class, nearly flat."""
    if rng.random() < 0.4:
        paint = any_colour(rng, saturation=(0.0, 0.5))
        return Opaque(made_of="paint", colour=paint, roughness=rng.uniform(0.3, 0.8))
    names = sorted(catalogue.textures)
    pool = catalogue.textures[names[int(rng.integers(len(names)))]]
    return dressed(rng, pool[int(rng.integers(len(pool)))], depth=0.004)


def _table(catalogue: Catalogue, rng: Rng) -> Thing:
    half = rng.uniform(1.6, 4.5)
    return Thing(_flat(half, half), _backdrop(catalogue, rng))


def _wall(catalogue: Catalogue, rng: Rng, away: Array) -> Thing:
    """Stand a wall behind the object, facing the camera."""
    upright = rotation(np.eye(3)[0], np.pi / 2)
    facing = rotation(_Y, float(np.arctan2(-away[0], -away[2])))
    level = np.array([away[0], 0.0, away[2]])
    place = level / np.linalg.norm(level) * rng.uniform(1.8, 3.5)
    return Thing(moved(_flat(6.0, 4.0), facing @ upright, place), _backdrop(catalogue, rng))


def _flat(x: float, z: float) -> Mesh:
    return sheet(lambda flat: np.zeros(len(flat)), (x, z), 2)


def _clutter(catalogue: Catalogue, rng: Rng, points: Array, away: Array) -> list[Thing]:
    """Put two to six things of one to three materials beside and behind the object."""
    reach = float(np.linalg.norm(points[:, [0, 2]], axis=1).max())
    behind = float(np.arctan2(away[2], away[0]))
    things = []
    for _ in range(int(rng.integers(1, 4))):
        meshes = [_beyond(rng, reach, behind) for _ in range(int(rng.integers(1, 3)))]
        surface = draw(str(rng.choice(list(_RECIPES))), int(rng.integers(8)), rng, catalogue)
        things.append(_dress(join(meshes), surface))
    return things


def _beyond(rng: Rng, reach: float, behind: float) -> Mesh:
    """Place a common shape on the table, farther than `reach` and never before the object."""
    size = rng.uniform(0.25, 0.9)
    mesh = shapes.make(str(rng.choice(shapes.COMMON)), rng)
    place = direction(behind + rng.uniform(-1.4, 1.4), 0.0) * (reach + size + rng.uniform(0.0, 1.6))
    shrunk = replace(mesh, points=mesh.points * size, uv=mesh.uv * size)
    return moved(shrunk, np.eye(3), place)
