"""Camera positions of the head: a touch approach, and a slow orbit.

Distances are found from the object's own points, so that every object fills the same share of the
picture. Scene units; y is up. Knows no renderer.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

FAR, NEAR = 0.6, 1.15  # share of the picture's side: root of the object's width times its height
VIEWS = 4
ORBIT_STEP = np.radians(0.5)
_CLOSEST, _FARTHEST = 0.15, 30.0  # scene units
_HALVINGS = 30


@dataclass(frozen=True, slots=True)
class Camera:
    """Eye and target (3,), field of view in degrees of the square picture."""

    eye: Array
    target: Array
    fov: float


def approach(points: Array, rng: np.random.Generator, views: int = VIEWS) -> list[Camera]:
    """Move in on points (N, 3) from FAR to NEAR, turning a little and coming down or up."""
    azimuth, elevation = _facing(points, rng), rng.uniform(0.12, 0.85)
    turn, rise = rng.normal(0, 0.12), rng.normal(0, 0.06)
    fov, aim = rng.uniform(40, 60), _aim(points, rng)
    cameras = []
    for step in np.linspace(0, 1, views):
        at = direction(azimuth + turn * step, max(0.05, elevation + rise * step))
        share = FAR * (NEAR / FAR) ** float(step)
        cameras.append(Camera(aim + at * distance(points, aim, at, fov, share), aim, fov))
    return cameras


def orbit(points: Array, rng: np.random.Generator, frames: int) -> list[Camera]:
    """Circle points (N, 3) by ORBIT_STEP a frame, at the distance of the middle frame."""
    azimuth, elevation = _facing(points, rng), rng.uniform(0.25, 0.6)
    fov, aim = rng.uniform(42, 52), _aim(points, rng)
    middle = direction(azimuth + ORBIT_STEP * frames / 2, elevation)
    far = distance(points, aim, middle, fov, 0.7)
    angles = azimuth + ORBIT_STEP * np.arange(frames)
    return [Camera(aim + direction(angle, elevation) * far, aim, fov) for angle in angles]


def direction(azimuth: float, elevation: float) -> Array:
    """Point from the object to the camera: (3,) unit."""
    level = np.cos(elevation)
    return np.array([level * np.cos(azimuth), np.sin(elevation), level * np.sin(azimuth)])


def distance(points: Array, aim: Array, at: Array, fov: float, share: float) -> float:
    """Find how far along `at` the points fill `share` of a picture, by halving."""
    low, high = _CLOSEST, _FARTHEST
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        if filled(points, Camera(aim + at * middle, aim, fov)) > share:
            low = middle
        else:
            high = middle
    return high


def filled(points: Array, camera: Camera) -> float:
    """Share of the picture's side that points fill; infinite when one lies behind the lens."""
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
    width, height = np.ptp(seen @ right / half) / 2, np.ptp(seen @ up / half) / 2
    return float(np.sqrt(width * height))


def _facing(points: Array, rng: np.random.Generator) -> float:
    """Choose the one of three azimuths from which points look widest: no sheet edge on."""
    azimuths = rng.uniform(0, 2 * np.pi, 3)
    across = np.stack([-np.sin(azimuths), np.cos(azimuths)])
    return float(azimuths[np.ptp(points[:, [0, 2]] @ across, axis=0).argmax()])


def _aim(points: Array, rng: np.random.Generator) -> Array:
    low, high = points.min(axis=0), points.max(axis=0)
    aim: Array = (low + high) / 2 + rng.uniform(-0.12, 0.12, 3) * (high - low)
    return aim
