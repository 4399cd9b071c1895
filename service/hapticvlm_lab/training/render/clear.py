"""Light through glass: what is behind, bent, tinted, blurred by frost, and what its faces mirror.

Thin walls shift the picture behind a little; solid bodies bend it by Snell's law through a ball of
their size, against the surroundings. Thickness, and so tint, grows where a wall is seen edge on.
"""

from __future__ import annotations

import torch
from torch import Tensor
from torch.nn import functional

from hapticvlm_lab.training.render.noise import mix, ramp
from hapticvlm_lab.training.render.shade import Lighting, Lit, floored, looked_up, shade
from hapticvlm_lab.training.render.surface import Bank
from hapticvlm_lab.training.render.view import Points, View, on_screen, unit

_BEHIND = 0.9  # how far behind a wall the picture it bends is taken to be


def through(canvas: Tensor, seen: View, points: Points, bank: Bank, light: Lighting) -> Tensor:
    """Radiance (3, P) of glass faces over a canvas (3, N * S * S) of what is behind them."""
    lit = looked_up(points, bank)
    ior = bank.of("ior", points.material)
    thin = bank.of("thin", points.material)
    frost = bank.of("frost", points.material)
    bent, inside, fresnel = _bent(lit, ior)
    leaving, way = _out(points, bent, inside, ior)
    straight = unit(-points.to_eye - (1 - lit.facing) ** 2 * 0.35 * lit.normal
                    + (lit.normal - points.normal) * 0.3)  # fmt: skip
    leaving = unit(mix(leaving, straight, thin))
    behind = _behind(canvas, seen, lit, leaving, frost)
    which = light.which[points.picture]
    away = light.sky.look(which, leaving, 0.8 * lit.roughness * frost)
    away = floored(lit, leaving, bank, light, away)
    turned = ramp(0.93, 0.8, -(leaving * points.to_eye).sum(0)) * (1 - thin)
    behind = mix(behind, away, turned)
    path = mix(way.clamp(max=2), 0.3 + 0.35 / (lit.facing + 0.12), thin)
    tint = bank.of("tint", points.material).clamp(min=0.01) ** (path * 1.2)
    fresnel = torch.where(thin > 0, 1 - (1 - fresnel) ** 2, fresnel).clamp(0, 1)
    front = shade(lit, bank, light, torch.ones_like(fresnel))
    mirror = light.sky.look(which, lit.reflected, 0.5 * lit.roughness * (0.1 + frost))
    mirror = floored(lit, lit.reflected, bank, light, mirror)
    mirror = mix(mirror, 0.5 * mirror, light.bare[points.picture])
    edge = 1 - 0.45 * thin * ramp(0.35, 0.05, lit.facing)
    passed = bank.of("transmission", points.material)
    clear = behind * tint * (1 - fresnel) * edge + mirror * fresnel + 0.6 * _dirt(lit, front)
    return mix(front, clear, passed)


def _dirt(lit: Lit, front: Tensor) -> Tensor:
    """Return what the face itself scatters back: dust, etching."""
    return front * (lit.albedo.mean(0) * 2).clamp(0, 1)


def _bent(lit: Lit, ior: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """Refracted direction (3, P), its cosine inside and the share mirrored (P,)."""
    cosine = lit.facing
    inside = (1 - (1 - cosine**2) / ior**2).clamp(min=0).sqrt()
    bent = -lit.points.to_eye / ior + (cosine / ior - inside) * lit.normal
    upright = ((cosine - ior * inside) / (cosine + ior * inside)) ** 2
    flat = ((ior * cosine - inside) / (ior * cosine + inside)) ** 2
    return bent, inside, 0.5 * (upright + flat)


def _out(points: Points, bent: Tensor, inside: Tensor, ior: Tensor) -> tuple[Tensor, Tensor]:
    """Where a ray leaves a ball of the body's size: direction (3, P) and way inside (P,)."""
    way = 2 * inside.clamp(min=0.05) * 0.9
    normal = unit(bent * way - points.normal * 0.9)
    cosine = (bent * normal).sum(0).clamp(0.02, 1)
    passed = 1 - ior**2 * (1 - cosine**2)
    leaving = ior * bent + (passed.clamp(min=0).sqrt() - ior * cosine) * normal
    total = bent - 2 * cosine * normal
    return unit(torch.where(passed < 0, total, leaving)), way


def _behind(canvas: Tensor, seen: View, lit: Lit, leaving: Tensor, frost: Tensor) -> Tensor:
    """Return the canvas where rays that leave the glass meet it, blurred by frost: (3, P)."""
    points = lit.points
    place = points.place + _BEHIND * leaving
    spot, _ = on_screen(seen, points.picture, place)
    side = seen.side
    picture = canvas.view(3, len(seen.scenes), side, side).transpose(0, 1)
    sharp = _sampled(picture, points.picture, spot, side)
    if not bool((frost > 0).any()):
        return sharp
    width = max(2, side // 18)
    soft = functional.avg_pool2d(picture, width)
    soft = functional.avg_pool2d(functional.pad(soft, (1, 1, 1, 1), mode="replicate"), 3, 1)
    blurred = _sampled(soft, points.picture, spot / width, soft.shape[-1])
    return mix(sharp, blurred, (frost * 1.5).clamp(0, 1))


def _sampled(picture: Tensor, which: Tensor, spot: Tensor, side: int) -> Tensor:
    """Bilinear samples of pictures (N, 3, side, side) at pixels (2, P), held at the border."""
    x = (spot[0] - 0.5).clamp(0, side - 1.001)
    y = (spot[1] - 0.5).clamp(0, side - 1.001)
    left, top = x.long(), y.long()
    px, py = x - left, y - top
    flat = picture.transpose(0, 1).reshape(3, -1)
    start = (which * side + top) * side + left
    upper = mix(flat[:, start], flat[:, start + 1], px)
    lower = mix(flat[:, start + side], flat[:, start + side + 1], px)
    return mix(upper, lower, py)
