"""Camera positions of the head: a touch approach, and a slow orbit.

Distances follow from the object's own points, so that every object fills the same share of the
picture. Scene units; y is up. Independent of any renderer.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# share of the picture's side: root of the object's width times its height
FAR = 0.6
NEAR = 1.15
VIEWS = 4
ORBIT_STEP = np.radians(0.5)
# scene units
_CLOSEST = 0.15
_FARTHEST = 30.0
_HALVINGS = 30


@dataclass(frozen=True, slots=True)
class Camera:
    """Eye and target (3,), field of view in degrees of the square picture."""

    eye: Array
    target: Array
    fov: float


def approach(points: Array, rng: np.random.Generator, views: int = VIEWS) -> list[Camera]:
    """Move in on points (N, 3) from FAR to NEAR, turning a little and coming down or up."""
    azimuth = _facing(points, rng)
    elevation = rng.uniform(0.12, 0.85)
    turn = rng.normal(0, 0.12)
    rise = rng.normal(0, 0.06)
    fov = rng.uniform(40, 60)
    aim = _aim(points, rng)
    cameras = []
    for step in np.linspace(0, 1, views):
        at = direction(azimuth + turn * step, max(0.05, elevation + rise * step))
        share = FAR * (NEAR / FAR) ** float(step)
        cameras.append(Camera(aim + at * distance(points, aim, at, fov, share), aim, fov))
    return cameras


def orbit(points: Array, rng: np.random.Generator, frames: int) -> list[Camera]:
    """Circle points (N, 3) by ORBIT_STEP a frame, at the distance of the middle frame."""
    azimuth = _facing(points, rng)
    elevation = rng.uniform(0.25, 0.6)
    fov = rng.uniform(42, 52)
    aim = _aim(points, rng)
    middle = direction(azimuth + ORBIT_STEP * frames / 2, elevation)
    far = distance(points, aim, middle, fov, 0.7)
    angles = azimuth + ORBIT_STEP * np.arange(frames)
    return [Camera(aim + direction(angle, elevation) * far, aim, fov) for angle in angles]


def direction(azimuth: float, elevation: float) -> Array:
    """Return the direction from the object to the camera: (3,) unit."""
    level = np.cos(elevation)
    return np.array([level * np.cos(azimuth), np.sin(elevation), level * np.sin(azimuth)])


def distance(points: Array, aim: Array, at: Array, fov: float, share: float) -> float:
    """Find the distance along `at` where the points fill `share` of a picture, by halving."""
    # The share falls with the distance, so halving finds it; no formula does for points of any
    # shape.
    low = _CLOSEST
    high = _FARTHEST
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        if filled(points, Camera(aim + at * middle, aim, fov)) > share:
            low = middle
        else:
            high = middle
    return high


def filled(points: Array, camera: Camera) -> float:
    """Return the share of the picture's side that points fill; infinite behind the lens."""
    forward = camera.target - camera.eye
    forward = forward / np.linalg.norm(forward)
    right = np.cross(forward, [0.0, 1.0, 0.0])
    right = right / np.linalg.norm(right)
    up = np.cross(right, forward)
    seen = points - camera.eye
    depth = seen @ forward
    if depth.min() < _CLOSEST:
        return float("inf")
    half = depth * np.tan(np.radians(camera.fov) / 2)
    width = np.ptp(seen @ right / half) / 2
    height = np.ptp(seen @ up / half) / 2
    return float(np.sqrt(width * height))


def _facing(points: Array, rng: np.random.Generator) -> float:
    """Choose the one of three azimuths from which points look widest: no sheet edge on."""
    azimuths = rng.uniform(0, 2 * np.pi, 3)
    across = np.stack([-np.sin(azimuths), np.cos(azimuths)])
    return float(azimuths[np.ptp(points[:, [0, 2]] @ across, axis=0).argmax()])


def _aim(points: Array, rng: np.random.Generator) -> Array:
    low = points.min(axis=0)
    high = points.max(axis=0)
    aim: Array = (low + high) / 2 + rng.uniform(-0.12, 0.12, 3) * (high - low)
    return aim
