"""Samples of materials to labelled pictures: the one function training calls.

Every sample is seen in several pictures, each with another shape, light and camera.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from hapticvlm import materials
from hapticvlm_lab.training.render import clear, develop, view
from hapticvlm_lab.training.render.compose import Props, compose
from hapticvlm_lab.training.render.dice import Dice
from hapticvlm_lab.training.render.light import Lights, Sky, sky
from hapticvlm_lab.training.render.rooms import surroundings
from hapticvlm_lab.training.render.scene import Scene
from hapticvlm_lab.training.render.shade import Lighting, lighting, looked_up, shade
from hapticvlm_lab.training.render.shadow import sunlit
from hapticvlm_lab.training.render.surface import Bank, Surface, bank
from hapticvlm_lab.training.render.surfaces import plain, sample
from hapticvlm_lab.training.render.tiles import Tiles

# Supersampling per side, and how often: none and coarse leave the jagged edges of VR frames.
_OVERSAMPLING = ((1.0, 0.35), (1.5, 0.45), (2.0, 0.2))
_LEAST_SEEN = 0.06  # share of the picture the target must fill; else it is drawn again, plainly
_TRIES = 4
_AS_GROUND = {"wood": 3.0, "stone": 3.0, "fabric": 2.0, "ceramic": 1.5, "foliage": 0.7}
_AT_ONCE = {"cpu": 1, "cuda": 64}  # pictures: a CPU's caches hold one


@dataclass(frozen=True, slots=True)
class Batch:
    """N pictures with what they show.

    images (N, S, S, 3) and masks (N, S, S) uint8, masks 255 where the sample is seen, else 0;
    labels and kinds ("wood/planks") of N; instances (N,) int64 tells samples apart.
    """

    images: NDArray[np.uint8]
    masks: NDArray[np.uint8]
    labels: tuple[str, ...]
    instances: NDArray[np.int64]
    kinds: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class _Stage:
    """What all pictures of a batch share."""

    names: tuple[str, ...]
    bank: Bank
    sky: Sky
    skies: int
    others: tuple[int, ...]
    grounds: tuple[tuple[int, float], ...]
    plain: tuple[int, ...]


def render(
    seed: int,
    names: Sequence[str],
    *,
    views: int,
    side: int,
    tiles: Tiles | None = None,
    lights: Lights | None = None,
    device: str = "cpu",
) -> Batch:
    """Render `views` pictures of `side` px of one sample of each named material.

    The same seed gives the same bytes on the same kind of device. Raises ValueError for a name
    outside the material table ("unknown" is allowed) or without samples.
    """
    wrong = sorted(set(names) - {*materials.MATERIALS, materials.UNKNOWN})
    if wrong or not names:
        raise ValueError(f"no such material: {', '.join(wrong)}" if wrong else "no materials")
    dice = Dice(seed, device)
    drawn = [sample(dice, name, tiles) for name in names]
    stage = _stage(dice, names, [surface for _, surface in drawn], lights)
    images, masks = [], []
    most = _AT_ONCE[torch.device(device).type]
    order = [number for number in range(len(names)) for _ in range(views)]
    for start in range(0, len(order), most):
        shot = _shot(dice, stage, order[start : start + most], side)
        images.extend(shot[0])
        masks.extend(shot[1])
    return Batch(
        np.stack(images),
        np.stack(masks),
        tuple(names[number] for number in order),
        np.array(order, np.int64),
        tuple(drawn[number][0] for number in order),
    )


def _stage(
    dice: Dice, names: Sequence[str], surfaces: Sequence[Surface], lights: Lights | None
) -> _Stage:
    skies = max(2, len(names) // 2)
    extra = [plain(dice) for _ in range(max(2, len(names) // 8))]
    last = range(len(names), len(names) + len(extra))
    opaque = [number for number, of in enumerate(surfaces) if of.finish.transmission == 0]
    return _Stage(
        names=tuple(names),
        bank=bank([*surfaces, *extra]),
        sky=sky([surroundings(dice, lights) for _ in range(skies)]),
        skies=skies,
        others=(*opaque, *last),
        grounds=(
            *((number, _AS_GROUND.get(names[number], 0.4)) for number in opaque),
            *((number, 0.05 + 1.5 * len(opaque) / len(names)) for number in last),
        ),
        plain=tuple(last),
    )


def _shot(
    dice: Dice, stage: _Stage, samples: Sequence[int], side: int
) -> tuple[list[NDArray[np.uint8]], list[NDArray[np.uint8]]]:
    """One picture of each sample; those whose target is hardly seen are drawn again."""
    images: dict[int, NDArray[np.uint8]] = {}
    masks: dict[int, NDArray[np.uint8]] = {}
    waiting = list(range(len(samples)))
    for attempt in range(_TRIES):
        props = [_props(stage, samples[number]) for number in waiting]
        scenes = [compose(dice, prop, plain=attempt > 0) for prop in props]
        light, covers = _exposure(scenes, stage, side, dice.weigh(_OVERSAMPLING), dice.device)
        for number, picture, cover in zip(tuple(waiting), light, covers, strict=True):
            if float(cover.float().mean()) >= _LEAST_SEEN or attempt == _TRIES - 1:
                images[number] = develop.developed(dice, picture, cover)
                masks[number] = (cover.cpu().numpy() * 255).astype(np.uint8)
                waiting.remove(number)
        if not waiting:
            break
    numbers = range(len(samples))
    return [images[number] for number in numbers], [masks[number] for number in numbers]


def _props(stage: _Stage, number: int) -> Props:
    is_clear = float(stage.bank.finish["transmission"][number]) > 0
    name = stage.names[number]
    return Props(number, name, is_clear, stage.others, stage.grounds, stage.plain, stage.skies)


def _exposure(
    scenes: Sequence[Scene], stage: _Stage, side: int, oversampling: float, device: str
) -> tuple[Tensor, Tensor]:
    """Light (N, 3, side, side) of scenes and where their targets are, (N, side, side) bool."""
    fine = round(side * oversampling)
    seen = view.view(scenes, fine, device)
    light = lighting(seen, stage.sky)
    canvas, cover = painted(seen, stage.bank, light)
    shape = (3, len(scenes), fine, fine)
    pictures = develop.reduced(torch.nan_to_num(canvas).view(shape).transpose(0, 1), side)
    covers = develop.reduced(cover.view(shape[1:])[:, None].float(), side)[:, 0]
    return pictures, covers >= 0.5


def painted(seen: view.View, bank: Bank, light: Lighting) -> tuple[Tensor, Tensor]:
    """Radiance (3, N * S * S) of every pixel, and whether it shows the target (N * S * S,)."""
    points, depth = view.opaque(seen)
    count = len(depth)
    empty = torch.ones(count, dtype=torch.bool, device=depth.device)
    empty[points.pixel] = False
    beyond = empty.nonzero()[:, 0]
    which = light.which[beyond // seen.side**2]
    canvas = torch.zeros(3, count, device=depth.device)
    canvas[:, beyond] = light.sky.sharp(which, view.unit(view.rays(seen, beyond)))
    lit = looked_up(points, bank)
    canvas[:, points.pixel] = shade(lit, bank, light, sunlit(seen, points))
    cover = torch.zeros(count, dtype=torch.bool, device=depth.device)
    cover[points.pixel] = points.target
    if any(scene.glass for scene in seen.scenes):
        for back in (True, False):
            faces = view.glass(seen, depth, back=back)
            if back:
                faces = _walled(seen, faces)
            canvas = canvas.clone()
            canvas[:, faces.pixel] = clear.through(canvas, seen, faces, bank, light)
            cover[faces.pixel] = True
    return canvas, cover


def _walled(seen: view.View, faces: view.Points) -> view.Points:
    """Only points of hollow bodies: solid ones have no inner wall to see."""
    hollow = torch.tensor([scene.walled for scene in seen.scenes], device=faces.pixel.device)
    keep = hollow[faces.picture].nonzero()[:, 0]
    fields = (getattr(faces, name) for name in view.Points.__slots__)
    return view.Points(*(field[..., keep] for field in fields))
