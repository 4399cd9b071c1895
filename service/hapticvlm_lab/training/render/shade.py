"""Light on surfaces: microfacets (GGX) under the surroundings and one sun; coat, sheen, brushing.

The reflection of the surroundings is their blurred picture times an analytic fit of the microfacet
integral (Karis, "Physically based shading on mobile", 2014); the sun is GGX with Smith's shadowing
in Schlick's form. Points and vectors as in `view`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import torch
from torch import Tensor

from hapticvlm_lab.training.render.light import Sky
from hapticvlm_lab.training.render.noise import SIDE, mix, ramp
from hapticvlm_lab.training.render.surface import Bank
from hapticvlm_lab.training.render.view import Points, View, unit

_LOBES = (-1.0, -0.5, 0.5, 1.0)  # of a brushed metal's highlight, beside the middle one


@dataclass(frozen=True, slots=True)
class Lighting:
    """Surroundings and suns of a batch: which sky (N,), sun direction and colour (3, N).

    `bare` (N,) is 1 where surroundings are not mirrored, as in simple game engines; `ground` (N, 5)
    is the floor's height (-inf: none), sample, density, and x and z of its texture's axis;
    `above` (3, N) is the light that falls on it.
    """

    sky: Sky
    which: Tensor
    towards: Tensor
    colour: Tensor
    bare: Tensor
    ground: Tensor
    above: Tensor


@dataclass(frozen=True, slots=True)
class Lit:
    """Points with their maps looked up. Vectors and colours (3, P), the rest (P,)."""

    points: Points
    albedo: Tensor
    roughness: Tensor
    metalness: Tensor
    open_sky: Tensor
    normal: Tensor
    facing: Tensor  # cosine between normal and eye
    reflected: Tensor


def lighting(seen: View, sky: Sky) -> Lighting:
    """Gather the lights of a batch's scenes."""
    device = seen.eye.device
    scenes = seen.scenes
    rows = []
    for scene in scenes:
        row = [-math.inf, 0.0, 1.0, 1.0, 0.0]
        for plane in scene.planes:
            if plane.normal[1] > 0.5:
                axis = (float(plane.across[0]), float(plane.across[2]))
                row = [plane.offset, plane.material, plane.density, *axis]
        rows.append(row)
    which = torch.tensor([scene.surrounding for scene in scenes], device=device)
    towards = torch.tensor([scene.sun.direction.tolist() for scene in scenes], device=device).T
    colour = torch.tensor([scene.sun.colour.tolist() for scene in scenes], device=device).T
    up = torch.zeros_like(towards)
    up[1] = 1
    bare = torch.tensor([float(scene.bare) for scene in scenes], device=device)
    above = sky.irradiance(which, up) + colour * towards[1]
    return Lighting(sky, which, towards, colour, bare, torch.tensor(rows, device=device), above)


def looked_up(points: Points, bank: Bank) -> Lit:
    """Look the maps up and bend the normals by them."""
    maps = bank.texels(points.material, points.uv, points.level)
    slopes = maps[3:5] * 1.6
    normal = unit(points.normal - slopes[0] * points.across - slopes[1] * points.down)
    facing = (normal * points.to_eye).sum(0).clamp(0.02, 1)
    reflected = 2 * facing * normal - points.to_eye
    open_sky = (1 + 0.35 * maps[7]).clamp(0.35, 1.15)
    rough = maps[5].clamp(0.03, 1)
    return Lit(points, maps[:3], rough, maps[6], open_sky, normal, facing, reflected)


def shade(lit: Lit, bank: Bank, light: Lighting, sun: Tensor) -> Tensor:
    """Radiance (3, P) towards the eye; `sun` (P,) is the share of the sun that arrives."""
    points, which = lit.points, light.which[lit.points.picture]
    base = bank.of("reflectance", points.material)
    mirror = mix(base.expand_as(lit.albedo), lit.albedo, lit.metalness)
    scale, offset = _integral(lit.roughness, lit.facing)
    share = mirror * scale + offset
    wrap = bank.of("wrap", points.material)
    bent = unit(mix(lit.normal, points.to_eye, 0.3 * wrap))
    around = light.sky.irradiance(which, bent).clamp(min=0.01) * shelter(points, light)
    direct, glint = _sunlight(lit, light, mirror, wrap)
    direct, glint = direct * sun, glint * sun
    dull = lit.albedo * (1 - lit.metalness) * (1 - share)
    colour = dull * (around * lit.open_sky + direct)
    colour = colour + share * mirrored(lit, bank, light, around) * lit.open_sky + glint
    if bank.uses("sheen"):
        rim = bank.of("sheen", points.material) * (1 - lit.facing) ** 3 * 0.8
        colour = colour + rim * bank.of("sheen_colour", points.material) * (around + direct)
    return _coated(colour, lit, bank, light, sun) if bank.uses("coat") else colour


def mirrored(lit: Lit, bank: Bank, light: Lighting, around: Tensor) -> Tensor:
    """Return the surroundings as the surface mirrors them: (3, P)."""
    which = light.which[lit.points.picture]
    seen = light.sky.look(which, lit.reflected, lit.roughness * 0.9)
    if bank.uses("anisotropy"):
        brushed = bank.of("anisotropy", lit.points.material)
        some = (brushed > 0).nonzero()[:, 0]
        if len(some):
            seen[:, some] = _brushed(lit, light, some, 0.45 * brushed[some], seen[:, some])
    seen = floored(lit, lit.reflected, bank, light, seen)
    bare = light.bare[lit.points.picture]
    return mix(seen, around, bare) if bool((light.bare > 0).any()) else seen


def floored(lit: Lit, direction: Tensor, bank: Bank, light: Lighting, sky: Tensor) -> Tensor:
    """Put the floor in place of the sky along directions (3, P) that meet it: (3, P).

    Smooth surfaces see its texture, rough ones its mean colour; far away it gives way to the sky.
    """
    points, ground = lit.points, light.ground[lit.points.picture].T
    with_floor = torch.isfinite(ground[0])
    if not bool(with_floor.any()):
        return sky
    soft = 0.04 + 0.5 * lit.roughness
    share = ((0.3 * soft - direction[1]) / soft).clamp(0, 1) * with_floor
    colour = bank.mean[ground[1].long()].T.contiguous()
    height = (points.place[1] - ground[0]).clamp(0, 5)
    way = height / (-direction[1]).clamp(min=0.02)
    clear = ((lit.roughness < 0.3) & (share > 0) & (way < 12)).nonzero()[:, 0]
    place = points.place + way * direction
    if len(clear):
        width = (0.01 + 0.5 * lit.roughness[clear]) * way[clear]
        colour[:, clear] = _floor_colour(bank, ground[:, clear], place[:, clear], width)
    shadow = 1 - 0.55 * torch.exp(-1.5 * (place[0] ** 2 + place[2] ** 2))
    return mix(sky, colour * light.above[:, points.picture] * shadow, share * torch.exp(-way / 8))


def _floor_colour(bank: Bank, ground: Tensor, place: Tensor, width: Tensor) -> Tensor:
    """Look the floor's texture up where rays of some width (P,) meet it: (3, P)."""
    _, material, density, x, z = ground
    across = place[0] * x + place[2] * z
    down = place[0] * z - place[2] * x
    level = torch.log2((SIDE * density * width).clamp(min=1))
    return bank.texels(material.long(), torch.stack([across, down]) * density, level)[:3]


def shelter(points: Points, light: Lighting) -> Tensor:
    """How open the sky is near the floor: darker under and beside what stands there: (P,)."""
    height = points.place[1] - light.ground[points.picture, 0]
    down = 0.5 - 0.5 * points.normal[1]
    near = torch.exp(-height.clamp(0, 9) / 0.35)
    away = points.place[0] ** 2 + points.place[2] ** 2
    under = torch.exp(-1.5 * away) * points.plane * (points.normal[1] > 0.5)
    return (1 - 0.6 * near * down) * (1 - 0.6 * under)


def _integral(roughness: Tensor, facing: Tensor) -> tuple[Tensor, Tensor]:
    """Karis's fit of the microfacet integral: scale of, and addition to, the base reflectance."""
    first = 1 - roughness
    grazing = torch.minimum(first * first, torch.exp2(-9.28 * facing)) * first
    grazing = grazing + 0.0425 - 0.0275 * roughness
    scale = -1.04 * grazing + 1.04 - 0.572 * roughness
    return scale, 1.04 * grazing + 0.022 * roughness - 0.04


def _sunlight(lit: Lit, light: Lighting, mirror: Tensor, wrap: Tensor) -> tuple[Tensor, Tensor]:
    """Irradiance / pi of the sun on dull surfaces and its glint on shiny ones: (3, P) each."""
    towards = light.towards[:, lit.points.picture]
    colour = light.colour[:, lit.points.picture]
    raw = (lit.normal * towards).sum(0)
    level = (lit.points.normal * towards).sum(0)
    above = ramp(-0.05, 0.15, level)
    reached = ((raw + wrap) / (1 + wrap)).clamp(0, 1) * above
    glint = _glint(lit, towards, lit.normal, lit.roughness)
    half = unit(towards + lit.points.to_eye)
    grazing = (1 - (lit.points.to_eye * half).sum(0).clamp(0, 1)) ** 5
    fresnel = mirror + (1 - mirror) * grazing
    return colour * reached, colour * fresnel * (glint * raw.clamp(0, 1) * above).clamp(max=30)


def _glint(lit: Lit, towards: Tensor, normal: Tensor, roughness: Tensor) -> Tensor:
    """GGX distribution times visibility: (P,)."""
    half = unit(towards + lit.points.to_eye)
    cosine = (normal * half).sum(0).clamp(0, 1)
    squared = (roughness * roughness).clamp(min=0.004) ** 2
    spread = squared / (math.pi * (cosine * cosine * (squared - 1) + 1) ** 2)
    k = (roughness + 1) ** 2 / 8
    lit_cosine = (normal * towards).sum(0).clamp(0, 1)
    hidden = (lit_cosine * (1 - k) + k) * (lit.facing * (1 - k) + k)
    return 0.25 * spread / hidden


def _brushed(lit: Lit, light: Lighting, some: Tensor, strength: Tensor, middle: Tensor) -> Tensor:
    """Highlights drawn out across the brushing: the mean over normals fanned along v."""
    normal, rough, to_eye = lit.normal[:, some], lit.roughness[some], lit.points.to_eye[:, some]
    which, down = light.which[lit.points.picture[some]], lit.points.down[:, some]
    total = middle
    for lobe in _LOBES:
        fanned = unit(normal + lobe * strength * rough * down)
        reflected = 2 * (fanned * to_eye).sum(0) * fanned - to_eye
        total = total + light.sky.look(which, reflected, rough * 0.6)
    return total / (1 + len(_LOBES))


def _coated(colour: Tensor, lit: Lit, bank: Bank, light: Lighting, sun: Tensor) -> Tensor:
    """Return a clear coat over all: mirrors at its own roughness by the smooth normal."""
    points = lit.points
    coat = bank.of("coat", points.material)
    some = (coat > 0).nonzero()[:, 0]
    if not len(some):
        return colour
    part, to_eye = coat[some], points.to_eye[:, some]
    normal = unit(mix(points.normal[:, some], lit.normal[:, some], 0.3))
    facing = (normal * to_eye).sum(0).clamp(0.02, 1)
    rough = bank.of("coat_roughness", points.material)[some]
    picture = points.picture[some]
    share = part * (0.04 + 0.96 * (1 - facing) ** 5) * (1 - 0.6 * light.bare[picture])
    direction = 2 * facing * normal - to_eye
    seen = light.sky.look(light.which[picture], direction, rough)
    towards = light.towards[:, picture]
    half = unit(towards + to_eye)
    squared = (rough * rough).clamp(min=0.004) ** 2
    cosine = (normal * half).sum(0).clamp(0, 1)
    spread = squared / (math.pi * (cosine * cosine * (squared - 1) + 1) ** 2)
    glint = (0.01 * part * spread * (normal * towards).sum(0).clamp(0, 1)).clamp(max=20)
    result = colour.clone()
    result[:, some] = colour[:, some] * (1 - share) + share * seen
    result[:, some] += glint * light.colour[:, picture] * sun[some]
    return result
