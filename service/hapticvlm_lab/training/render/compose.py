"""Draw what stands in a picture: the target's shape and place, clutter, occluders, camera, light.

Random but plausible: things stand on the floor, the camera frames the target, what is in front
hides at most about half of it. Knows no pixels and no colours but the sun's.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hapticvlm_lab.training.render import bodies
from hapticvlm_lab.training.render.bodies.body import Body
from hapticvlm_lab.training.render.dice import Dice
from hapticvlm_lab.training.render.mesh import Floats, Mesh, about_y, any_turn, faceted, floats
from hapticvlm_lab.training.render.scene import UP, Camera, Part, Plane, Scene, Sun

# Maps per unit of length on the target, which is 2 long: fine grains repeat more often.
_DENSITY = {
    "fabric": (0.4, 2.2),
    "leather": (0.6, 2.2),
    "rubber": (0.4, 1.2),
    "paper": (0.3, 1.3),
    "metal": (0.25, 1.0),
}
_HERE = floats([0, 0, 0])


@dataclass(frozen=True, slots=True)
class Props:
    """What a scene may use: the target's sample and class, other samples, how many skies.

    `others` are samples for clutter, `grounds` for floors and walls with their weights, `plain`
    ones of a single colour.
    """

    material: int
    name: str
    glass: bool
    others: Sequence[int]
    grounds: Sequence[tuple[int, float]]
    plain: Sequence[int]
    skies: int


def compose(dice: Dice, props: Props, *, plain: bool = False) -> Scene:
    """Draw a scene; `plain` leaves out what may hide the target."""
    shape = bodies.body(dice, props.name)
    density = dice.spread(*_DENSITY.get(props.name, (0.22, 0.8)))
    angle = dice.uniform(0, 6.28) * dice.chance(0.5)
    offset = floats([dice.uniform(), dice.uniform()])
    turn = about_y(dice.uniform(0, 6.28)) if shape.upright else any_turn(dice.numbers)
    form = faceted(shape.mesh) if dice.chance(0.05) else shape.mesh
    mesh = form.textured(density, angle, offset).moved(turn, _HERE)
    camera = _camera(dice, mesh, shape)
    planes = _planes(dice, props, mesh, camera)
    others = _clutter(dice, props, planes, camera)
    if shape.companion is not None:
        beside = shape.companion.textured(0.5, 0.0, offset).moved(turn, _HERE)
        others.append(Part(beside, dice.choose(props.others), open=True))
    if props.glass and shape.walled and dice.chance(0.3):
        others.append(_liquid(dice, props, mesh))
    if not plain and dice.chance(0.3):
        others += [_occluder(dice, props, camera) for _ in range(dice.integer(1, 2))]
    target = Part(mesh, props.material, shape.open and not props.glass)
    hollow = shape.walled or (props.glass and shape.open)
    return Scene(
        target=target,
        glass=props.glass,
        walled=hollow,
        others=tuple(others),
        planes=tuple(planes),
        camera=camera,
        sun=_sun(dice),
        surrounding=dice.integer(0, props.skies - 1),
        bare=dice.chance(0.13),
        coarse=dice.uniform(1, 2.5) if dice.chance(0.15) else 0.0,
    )


def _sun(dice: Dice) -> Sun:
    level = dice.spread(0.3, 3.5) if dice.chance(0.65) else 0.0
    warm = dice.uniform(0, 0.4) if dice.chance(0.5) else 0.0
    direction = floats([dice.normal(), dice.uniform(0.25, 1.6), dice.normal()])
    colour = floats([1, 1 - 0.5 * warm, 1 - warm]) * np.float32(level)
    return Sun(_unit(direction), colour)


def _camera(dice: Dice, mesh: Mesh, shape: Body) -> Camera:
    """Look at the target so that it takes 40 to 100 % of the picture, or more when it `fills`."""
    towards = _viewpoint(dice, mesh, shape)
    eye = towards * np.float32(dice.spread(1.5, 5) * max(mesh.radius, 0.3))
    forward = -towards
    right = _unit(np.cross(forward, UP + floats([dice.normal(0.06), 0, dice.normal(0.06)])))
    turn = np.stack([right, np.cross(right, forward), forward]).astype(np.float32)
    seen = (mesh.points - eye) @ turn.T
    flat = seen[:, :2] / np.maximum(seen[:, 2:], 0.05)
    low, high = flat.min(0), flat.max(0)
    size = dice.spread(1.1, 3.5) if shape.fills and dice.chance(0.7) else dice.uniform(0.55, 1.08)
    focal = min(size / max(float((high - low).max()), 1e-3), 12.0)
    middle = (low + high) / 2
    room = max(0.0, 1 - size) / 2 + 0.04
    shift = [dice.uniform(-room, room) for _ in range(2)]
    if size > 1.1:
        middle = low + (high - low) * floats([dice.uniform(0.35, 0.65) for _ in range(2)])
    centre = (0.5 - focal * float(middle[0]) + shift[0], 0.5 + focal * float(middle[1]) + shift[1])
    return Camera(eye.astype(np.float32), turn, focal, centre)


def _viewpoint(dice: Dice, mesh: Mesh, shape: Body) -> Floats:
    """Return a direction from the target to the eye; flat things are not seen edge on."""
    extent = mesh.points.max(0) - mesh.points.min(0)
    spread = np.linalg.eigh(np.cov(mesh.points.T))
    flat = spread[0][0] < 0.06 * spread[0][2]
    axis = spread[1][:, 0]
    for _ in range(12):
        around, rise = dice.uniform(0, 6.28), dice.uniform(-0.1, 1.1)
        if shape.fills and extent[1] < 0.4:
            rise = dice.uniform(0.25, 1.4)
        level = math.cos(rise)
        towards = floats([level * math.cos(around), math.sin(rise), level * math.sin(around)])
        if not flat or abs(float(towards @ axis)) > 0.35:
            break
    return towards


def _planes(dice: Dice, props: Props, mesh: Mesh, camera: Camera) -> list[Plane]:
    """Return a floor under the target and a wall behind it, more often than not."""
    planes = []
    floor = float(mesh.points[:, 1].min()) - (0.002 if dice.chance(0.8) else dice.uniform(0.1, 0.8))
    if dice.chance(0.75) and camera.eye[1] > floor + 0.15:
        planes.append(_plane(dice, props, UP, floor))
    if dice.chance(0.5):
        away = math.atan2(float(camera.eye[2]), float(camera.eye[0])) + dice.normal(0.4)
        normal = floats([math.cos(away), 0, math.sin(away)])
        reach = float((mesh.points @ normal).min())
        planes.append(_plane(dice, props, normal, reach - dice.spread(0.02, 3)))
    return planes


def _plane(dice: Dice, props: Props, normal: Floats, offset: float) -> Plane:
    angle = dice.uniform(0, 6.28)
    if normal[1] > 0.5:
        across = floats([math.cos(angle), 0, math.sin(angle)])
    else:
        across = _unit(np.cross(UP, normal))
    return Plane(normal, offset, across, dice.weigh(props.grounds), dice.spread(0.15, 0.6))


def _clutter(dice: Dice, props: Props, planes: Sequence[Plane], camera: Camera) -> list[Part]:
    """Things around and behind the target, on the floor when there is one."""
    floors = [plane.offset for plane in planes if plane.normal[1] > 0.5]
    floor = floors[0] if floors else None
    behind = _unit(floats([-camera.eye[0], 0, -camera.eye[2]]))
    aside = floats([-behind[2], 0, behind[0]])
    most = 5 if props.glass else 3
    parts = []
    for _ in range(dice.integer(0, most) if dice.chance(0.7) else 0):
        size = dice.spread(0.25, 1.0)
        along = dice.uniform(-0.3, 3) if not props.glass else dice.uniform(0.8, 3)
        across = dice.normal(1.2) if along > 1 else dice.choose((-1, 1)) * dice.uniform(1.1, 2)
        place = behind * np.float32(along + size) + aside * np.float32(across * (1 + size / 2))
        parts.append(_thing(dice, props, bodies.clutter(dice), place, size, floor))
    return parts


def _thing(
    dice: Dice, props: Props, shape: Body, place: Floats, size: float, floor: float | None = None
) -> Part:  # fmt: skip
    turn = about_y(dice.uniform(0, 6.28)) if shape.upright else any_turn(dice.numbers)
    offset = floats([dice.uniform(), dice.uniform()])
    mesh = shape.mesh.textured(dice.spread(0.25, 0.8), 0.0, offset).moved(turn, _HERE, size)
    lift = dice.normal(0.5) if floor is None else floor - float(mesh.points[:, 1].min())
    shift = (place + floats([0, lift, 0])).astype(np.float32)
    moved = mesh.moved(np.eye(3, dtype=np.float32), shift)
    return Part(moved, dice.choose(props.others), shape.open)


def _occluder(dice: Dice, props: Props, camera: Camera) -> Part:
    """Something between the eye and the target that hides at most about half of it."""
    share = dice.uniform(0.35, 0.7)
    size = dice.uniform(0.15, 0.5) * share
    angle = dice.uniform(0, 6.28)
    away = np.float32(share * dice.uniform(0.35, 0.9) + 0.6 * size)
    aside = camera.turn[0] * np.float32(math.cos(angle)) + camera.turn[1] * np.float32(
        math.sin(angle)
    )
    place = camera.eye * np.float32(1 - share) + aside * away
    shape = bodies.stick(dice) if dice.chance(0.5) else bodies.clutter(dice)
    turn = any_turn(dice.numbers)
    mesh = shape.mesh.textured(0.5, 0.0, floats([0, 0])).moved(turn, place, size)
    return Part(mesh, dice.choose(props.others), shape.open)


def _liquid(dice: Dice, props: Props, mesh: Mesh) -> Part:
    """Fill a vessel: its own shape, a little smaller, flattened above the level."""
    points = mesh.points * floats([0.88, 0.97, 0.88])
    low, high = float(points[:, 1].min()), float(points[:, 1].max())
    level = low + (high - low) * dice.uniform(0.25, 0.75)
    above = points[:, 1:2] > level
    points[:, 1] = np.minimum(points[:, 1], level)
    normals = np.where(above, UP, mesh.normals).astype(np.float32)
    frames = (mesh.tangents, mesh.bitangents, mesh.uv)
    return Part(Mesh(points, normals, *frames, mesh.faces), dice.choose(props.plain), open=True)


def _unit(vector: Floats) -> Floats:
    unit: Floats = (vector / (np.linalg.norm(vector) + 1e-9)).astype(np.float32)
    return unit
