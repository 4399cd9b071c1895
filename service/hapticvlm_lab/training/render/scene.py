"""What stands in a picture and who looks at it: target, other things, planes, camera, sun.

A scene is meshes on the host: the target is at the origin with radius 1, y is up. Knows no pixels
and no colours but the sun's.
"""

from __future__ import annotations

from dataclasses import dataclass

from hapticvlm_lab.training.render.mesh import Floats, Mesh, floats

UP = floats([0, 1, 0])


@dataclass(frozen=True, slots=True)
class Part:
    """A mesh in the world and its sample of the bank; `open` is drawn from both sides."""

    mesh: Mesh
    material: int
    open: bool = False


@dataclass(frozen=True, slots=True)
class Plane:
    """An endless plane: unit normal (3,), offset normal . p, texture axes (3,), sample."""

    normal: Floats
    offset: float
    across: Floats
    material: int
    density: float


@dataclass(frozen=True, slots=True)
class Camera:
    """A pinhole: eye (3,), rows of `turn` (3, 3) are right, up, forward.

    A direction (r, u, 1) falls on (centre_x + focal r, centre_y - focal u), in picture sides.
    """

    eye: Floats
    turn: Floats
    focal: float
    centre: tuple[float, float]


@dataclass(frozen=True, slots=True)
class Sun:
    """A distant lamp: direction to it (3,), colour (3,), black when it is off."""

    direction: Floats
    colour: Floats


@dataclass(frozen=True, slots=True)
class Scene:
    """One picture's contents.

    glass: light passes the target; walled: it is hollow; bare: as simple games shade, without
    mirrored surroundings; coarse: mip levels by which textures are too coarse.
    """

    target: Part
    glass: bool
    walled: bool
    others: tuple[Part, ...]
    planes: tuple[Plane, ...]
    camera: Camera
    sun: Sun
    surrounding: int
    bare: bool
    coarse: float
