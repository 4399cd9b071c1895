"""From light to a picture: exposure, white balance, tone curve, blur, bloom, noise, JPEG.

What cameras do, and what game engines do after rendering. Pictures are (N, 3, S, S) linear.
"""

from __future__ import annotations

from io import BytesIO

import numpy as np
import torch
from numpy.typing import NDArray
from PIL import Image
from torch import Tensor
from torch.nn import functional

from hapticvlm_lab.training.render.dice import Dice
from hapticvlm_lab.training.render.noise import mix

_BRIGHTEST = 8.0  # radiance is cut here before pixels are averaged


def reduced(canvas: Tensor, side: int) -> Tensor:
    """Average supersampled pictures (N, 3, *, *) down to `side`."""
    cut = canvas.clamp(0, _BRIGHTEST)
    if canvas.shape[-1] == side:
        return cut
    return functional.interpolate(cut, (side, side), mode="area")


def developed(dice: Dice, light: Tensor, mask: Tensor) -> NDArray[np.uint8]:
    """Develop one picture (3, S, S) whose target is mask (S, S) bool: (S, S, 3) uint8."""
    light = _defocused(dice, light, mask)
    if dice.chance(0.2):
        wide = _blurred(light.clamp(min=1) - 1, 9)
        light = light + wide * dice.uniform(0.3, 1.2)
    encoded = _encoded(_toned(dice, _exposed(dice, light, mask)))
    grey = encoded.mean(0, keepdim=True)
    encoded = grey + (encoded - grey) * 2.718 ** dice.normal(0.15)
    encoded = (encoded - 0.4) * dice.spread(0.9, 1.35) + 0.4
    encoded = _sharpened(dice, encoded)
    if dice.chance(0.6):
        encoded = encoded + dice.field(*encoded.shape) * dice.uniform(0, 0.03)
    pixels = (encoded.clamp(0, 1) * 255).round().byte().permute(1, 2, 0).cpu().numpy()
    return _compressed(dice, pixels) if dice.chance(0.75) else np.ascontiguousarray(pixels)


def _exposed(dice: Dice, light: Tensor, mask: Tensor) -> Tensor:
    """Expose for the whole picture, the target or neither; tint by the white balance."""
    mean = light.mean()
    on_target = light[:, mask].mean() if bool(mask.any()) else mean
    metered = mix(mean, on_target, dice.choose((0.2, 0.5, 0.8)))
    level = dice.spread(0.1, 0.45) / (metered + 0.03)
    balance = torch.tensor([2.718 ** dice.normal(0.07) for _ in range(3)], device=light.device)
    return light * level * balance[:, None, None]


def _toned(dice: Dice, light: Tensor) -> Tensor:
    """Return a tone curve: none, filmic (ACES as fitted by Narkowicz) or Reinhard's."""
    curve = dice.integer(0, 2)
    if curve == 1:
        light = light * (2.51 * light + 0.03) / (light * (2.43 * light + 0.59) + 0.14)
    elif curve == 2:
        light = 1.25 * light * (1 + light / 9) / (1 + light)
    return light.clamp(0, 1)


def _encoded(linear: Tensor) -> Tensor:
    """Linear light to sRGB, 0 to 1."""
    curve = 1.055 * linear.clamp(min=0.0031308) ** (1 / 2.4) - 0.055
    return torch.where(linear < 0.0031308, 12.92 * linear, curve)


def _defocused(dice: Dice, light: Tensor, mask: Tensor) -> Tensor:
    """Blur what is around the target, or everything a little."""
    if dice.chance(0.2):
        inside = _blurred(mask.to(light)[None], 3).clamp(0, 1)
        return mix(_blurred(light, dice.choose((3, 5, 9))), light, inside)
    if dice.chance(0.3):
        return mix(light, _blurred(light, 3), dice.uniform(0, 1))
    if dice.chance(0.05):
        return _blurred(light, 5)
    return light


def _sharpened(dice: Dice, encoded: Tensor) -> Tensor:
    """Over-sharpen, or pass through a lower resolution, as headsets and streams do."""
    if dice.chance(0.2):
        return encoded + dice.uniform(0.3, 1.0) * (encoded - _blurred(encoded, 3))
    if dice.chance(0.25):
        side = encoded.shape[-1]
        low = int(side * dice.uniform(0.5, 0.95))
        small = functional.interpolate(encoded[None], (low, low), mode="area")
        how = dice.choose(("bilinear", "bicubic", "nearest"))
        back = None if how == "nearest" else False
        return functional.interpolate(small, (side, side), mode=how, align_corners=back)[0]
    return encoded


def _blurred(picture: Tensor, width: int) -> Tensor:
    """Return a box blur twice over, of odd width: (C, S, S)."""
    reach = width // 2
    for _ in range(2):
        padded = functional.pad(picture[None], (reach,) * 4, mode="replicate")
        picture = functional.avg_pool2d(padded, width, 1)[0]
    return picture


def _compressed(dice: Dice, pixels: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Through a real JPEG of quality 40 to 95."""
    store = BytesIO()
    Image.fromarray(pixels).save(store, "JPEG", quality=dice.integer(40, 95))
    with Image.open(store) as image:
        return np.asarray(image.convert("RGB"))
