"""Texture statistics: what plain image processing shows of the surface under a mask.

Colour, highlights, contrast to the surroundings, spectrum, and at four levels of a pyramid
gradients, orientations and local binary patterns. The first encoder was a linear map of these; now
they are what a network has to beat.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hapticvlm.vision.pictures import Crop

Floats = NDArray[np.float32]
Inside = NDArray[np.bool_]

LENGTH = 152
LEVELS = 4  # of the pyramid, each half the size of the one before
HUES = 8
ORIENTATIONS = 8
BANDS = 6  # of the spectrum, an octave each but the lowest
LBP_STEP = 0.008  # of full scale, about 2 grey levels: below it neighbours count as equal
LIT = 0.94  # brightness from which a pixel counts as highlight
EPSILON = 1e-4

_NEIGHBOURS = ((0, 0), (0, 1), (0, 2), (1, 2), (2, 2), (2, 1), (2, 0), (1, 0))


def describe(crop: Crop) -> Floats:
    """Describe what lies under the mask: (LENGTH,) float32, all finite."""
    pixels = crop.image.astype(np.float32) / 255.0
    inside = crop.mask > 0
    if not inside.any():
        inside = np.ones(inside.shape, np.bool_)
    grey = pixels @ np.array((0.299, 0.587, 0.114), np.float32)
    parts = [_colours(pixels[inside], grey[inside]), _contrast(pixels, grey, inside)]
    parts.append(_spectrum(grey, inside))
    for _ in range(LEVELS):
        parts += [_gradients(grey, inside), _patterns(grey, inside)]
        grey, inside = _halve(grey, inside)
    description: Floats = np.nan_to_num(np.concatenate(parts)).astype(np.float32)
    return description


def _colours(colour: Floats, grey: Floats) -> Floats:
    """Statistics of (P, 3) colours and (P,) brightness: level, spread, tails, hues, highlights."""
    red_green = colour[:, 0] - colour[:, 1]
    yellow_blue = (colour[:, 0] + colour[:, 1]) / 2 - colour[:, 2]
    chroma = np.hypot(red_green, yellow_blue)
    hue = np.arctan2(yellow_blue, red_green) / (2 * np.pi) % 1.0
    hues = np.bincount((hue * HUES).astype(int) % HUES, weights=chroma, minlength=HUES)
    tails = np.percentile(grey, (2, 10, 25, 50, 75, 90, 98))
    deviation = grey - grey.mean()
    skew = (deviation**3).mean() / (deviation.std() ** 3 + EPSILON)
    lit = grey > LIT
    saturation = chroma / (grey + 0.05)
    means = [red_green.mean(), yellow_blue.mean(), chroma.mean(), saturation.mean()]
    spreads = [red_green.std(), yellow_blue.std(), chroma.std(), saturation.std(), grey.std()]
    rest = [skew, np.sqrt(lit.mean()), np.sqrt((lit & (chroma < 0.05)).mean())]
    scaled = np.sqrt(hues / (hues.sum() + EPSILON)) * np.sqrt(min(1.0, chroma.mean() * 8))
    return np.concatenate([means, spreads, tails, tails - tails[3], rest, scaled])


def _contrast(pixels: Floats, grey: Floats, inside: Inside) -> Floats:
    """Object against its surroundings: glass takes their colours, paint does not. (9,)."""
    outside = ~inside
    if not outside.any():
        return np.zeros(9, np.float32)
    gap = pixels[inside].mean(axis=0) - pixels[outside].mean(axis=0)
    spread = np.log((grey[inside].std() + 0.01) / (grey[outside].std() + 0.01))
    steps = np.abs(np.diff(grey, axis=1))
    busy = np.log((steps[inside[:, 1:]].mean() + 0.002) / (steps[outside[:, 1:]].mean() + 0.002))
    level = gap.mean()
    return np.concatenate([gap - level, np.abs(gap), [level, spread, busy]])


def _spectrum(grey: Floats, inside: Inside) -> Floats:
    """Log energy and peakedness by octave, and how much one direction leads. (2 BANDS + 1,)."""
    side = grey.shape[0]
    window = np.hanning(side).astype(np.float32)
    flat = np.where(inside, grey - grey[inside].mean(), 0.0) * np.outer(window, window)
    power = np.abs(np.fft.rfft2(flat)) ** 2
    y = np.fft.fftfreq(side)[:, None]
    x = np.fft.rfftfreq(side)[None, :]
    octave = np.clip(np.log2(np.hypot(x, y) * side + 1.0), 0, BANDS - 0.01).astype(int)
    counts = np.bincount(octave.ravel(), minlength=BANDS)[:BANDS]
    energy = np.bincount(octave.ravel(), weights=power.ravel(), minlength=BANDS)[:BANDS]
    peaks = np.array([power[octave == band].max() for band in range(BANDS)])
    mean = energy / np.maximum(counts, 1)
    share = np.log(energy / (energy.sum() + EPSILON) + EPSILON)
    twice = np.exp(2j * np.angle(x + 1j * y))
    middle = octave >= 2
    lead = np.abs((power * twice)[middle].sum()) / (power[middle].sum() + EPSILON)
    return np.concatenate([share, np.log(peaks / (mean + EPSILON) + 1.0), [lead]])


def _gradients(grey: Floats, inside: Inside) -> Floats:
    """Strength, tails and orientation of the gradient; bins start at the leading direction."""
    dx = (grey[1:-1, 2:] - grey[1:-1, :-2]) / 2
    dy = (grey[2:, 1:-1] - grey[:-2, 1:-1]) / 2
    bend = np.abs(grey[1:-1, 2:] + grey[1:-1, :-2] + grey[2:, 1:-1] + grey[:-2, 1:-1])
    bend = np.abs(bend - 4 * grey[1:-1, 1:-1])
    within = inside[1:-1, 1:-1]
    if not within.any():
        within = np.ones(within.shape, np.bool_)
    dx = dx[within]
    dy = dy[within]
    bend = bend[within]
    size = np.hypot(dx, dy)
    mean = size.mean() + EPSILON
    level = grey[1:-1, 1:-1][within].mean() + 0.05
    turn = (np.arctan2(dy, dx) / np.pi % 1.0 * ORIENTATIONS).astype(int) % ORIENTATIONS
    bins = np.bincount(turn, weights=size, minlength=ORIENTATIONS) / (size.sum() + EPSILON)
    bins = np.roll(bins, -int(bins.argmax()))
    tails = np.percentile(size, (50, 95, 99)) / mean
    shape = [np.log(mean), np.log(mean / level), np.log(bend.mean() / mean + 0.05)]
    return np.concatenate([shape, np.log(tails + 0.05), bins])


def _patterns(grey: Floats, inside: Inside) -> Floats:
    """Rotation-invariant uniform local binary patterns: (10,) square roots of their shares."""
    rows = grey.shape[0] - 2
    columns = grey.shape[1] - 2
    centre = grey[1:-1, 1:-1] + LBP_STEP
    bits = np.stack([grey[y : y + rows, x : x + columns] > centre for y, x in _NEIGHBOURS])
    turns = (bits != np.roll(bits, 1, axis=0)).sum(axis=0)
    codes = np.where(turns <= 2, bits.sum(axis=0), 9)
    within = inside[1:-1, 1:-1]
    chosen = codes[within] if within.any() else codes.ravel()
    return np.sqrt(np.bincount(chosen, minlength=10) / chosen.size)


def _halve(grey: Floats, inside: Inside) -> tuple[Floats, Inside]:
    """Half the size: mean of 2 x 2 for the picture, all of 2 x 2 for the mask."""
    side = grey.shape[0] // 2 * 2
    blocks = grey[:side, :side].reshape(side // 2, 2, side // 2, 2)
    masks = inside[:side, :side].reshape(side // 2, 2, side // 2, 2)
    smaller: Inside = np.asarray(masks.all(axis=(1, 3)))
    return blocks.mean(axis=(1, 3)), smaller
