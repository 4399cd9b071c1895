"""`hapticvlm stability conventions`: the decisions that survive how pictures are taken and shown.

A scene's camera, a headset's mirror or a player changes a picture without changing the thing: it is
letterboxed, foveated, in fog, out of focus. Each convention is applied to the same pictures, whole,
as `hapticvlm recognise` looks at them. Pictures count that are decided as they are; a decision is
then kept, lost (unknown), or another material, which is the worst of the three. Mirroring changes
nothing that matters, so its row is the noise of the others.

Lengths are for a picture of SIDE px on its longer side, to which each one is shrunk first.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from io import BytesIO
from pathlib import Path
from typing import Literal

import numpy as np
from PIL import Image, ImageFilter

from hapticvlm.commands.progress import track
from hapticvlm.errors import UsageError, why_no_folder
from hapticvlm.materials import UNKNOWN
from hapticvlm.palette import BLUE, SOFT, VERMILION
from hapticvlm.vision.files import list_files
from hapticvlm.vision.picture_recogniser import PictureRecogniser
from hapticvlm_lab.bench import figures
from hapticvlm_lab.bench.printing import publish

NAME = "stability-conventions"
SIDE = 512
FOG = (200, 205, 210)
WARM = (1.0, 0.75, 0.45)  # factors of red, green and blue of a lamp of 2700 K, about
Fate = Literal["kept", "unknown", "another"]
FATES: tuple[tuple[Fate, str], ...] = (("kept", BLUE), ("unknown", SOFT), ("another", VERMILION))
WIDTH_IN, ROW_IN = 8.0, 0.28

Convention = Callable[[Image.Image], Image.Image]


def letterboxed(image: Image.Image, share: float) -> Image.Image:
    """Put black bars above and below, each of this share of the picture's height."""
    bar = round(image.height * share)
    whole = Image.new("RGB", (image.width, image.height + 2 * bar))
    whole.paste(image, (0, bar))
    return whole


def foggy(image: Image.Image, share: float) -> Image.Image:
    """Replace this share of each pixel by the light of the fog."""
    return Image.blend(image, Image.new("RGB", image.size, FOG), share)


def defocused(image: Image.Image, px: float) -> Image.Image:
    """Spread each point over a disc of this radius, nearly."""
    return image.filter(ImageFilter.BoxBlur(px * 0.6)).filter(ImageFilter.BoxBlur(px * 0.6))


def moved(image: Image.Image, px: int) -> Image.Image:
    """Average the picture along a horizontal path of so many px."""
    pixels = np.asarray(image).astype(np.float32)
    padded = np.pad(pixels, ((0, 0), (px // 2, px - 1 - px // 2), (0, 0)), mode="edge")
    mean = sum(padded[:, at : at + image.width] for at in range(px)) / px
    return Image.fromarray(np.asarray(mean).round().astype(np.uint8))


def foveated(image: Image.Image) -> Image.Image:
    """Keep the centre; render a ring around it at a third and the rest at an eighth of the size."""
    y, x = np.mgrid[0 : image.height, 0 : image.width]
    away = np.hypot(x / image.width - 0.5, y / image.height - 0.5)
    pixels = np.asarray(image).copy()
    for factor, beyond in ((3, 0.12), (8, 0.25)):
        size = (max(1, image.width // factor), max(1, image.height // factor))
        coarse = image.resize(size, Image.Resampling.BILINEAR)
        shown = coarse.resize(image.size, Image.Resampling.BILINEAR)
        pixels[away > beyond] = np.asarray(shown)[away > beyond]
    return Image.fromarray(pixels)


def lit(image: Image.Image, factors: Sequence[float]) -> Image.Image:
    """Multiply the light of each channel by a factor, in sRGB's approximate power of 2.2."""
    linear = (np.asarray(image) / 255.0) ** 2.2 * np.array(factors)
    return Image.fromarray((255.0 * linear.clip(0.0, 1.0) ** (1 / 2.2)).round().astype(np.uint8))


def compressed(image: Image.Image, quality: int) -> Image.Image:
    """Save as a JPEG of this quality and read it again."""
    file = BytesIO()
    image.save(file, "JPEG", quality=quality)
    return Image.open(file).convert("RGB")


def transparent(image: Image.Image) -> Image.Image:
    """Set the alpha to 0, as engines' screenshots have it."""
    shown = image.copy()
    shown.putalpha(0)
    return shown


CONVENTIONS: Mapping[str, Convention] = {
    "mirrored": lambda image: image.transpose(Image.Transpose.FLIP_LEFT_RIGHT),
    "upside down": lambda image: image.transpose(Image.Transpose.ROTATE_180),
    "a quarter turn": lambda image: image.transpose(Image.Transpose.ROTATE_90),
    "bars of 16:9": partial(letterboxed, share=1 / 6),
    "bars of 21:9": partial(letterboxed, share=0.375),
    "alpha of 0": transparent,
    "grey": lambda image: image.convert("L").convert("RGB"),
    "warm light": partial(lit, factors=WARM),
    "3 stops under": partial(lit, factors=(1 / 8,) * 3),
    "JPEG of quality 20": partial(compressed, quality=20),
    "motion of 9 px": partial(moved, px=9),
    "defocus of 3 px": partial(defocused, px=3.0),
    "defocus of 6 px": partial(defocused, px=6.0),
    "fog": partial(foggy, share=0.65),
    "foveated": foveated,
}


def run(folder: Path, limit: int, out: Path, *, as_json: bool) -> int:
    """Apply every convention; raises UsageError without a picture that is decided."""
    paths = pictures_in(folder)
    paths = paths if not limit else paths[:: -(-len(paths) // limit)]
    fates = fates_of(PictureRecogniser.load(), track(paths, "applying each convention"))
    count = sum(fates["mirrored"].values())
    if not count:
        raise UsageError(f"{folder}: none of {len(paths)} pictures is decided as it is")
    files = draw(fates, count, out / NAME)
    rows = {name: {fate: fates[name][fate] for fate, _ in FATES} for name in CONVENTIONS}
    report = {
        "stability": "conventions",
        "pictures": len(paths),
        "decided": count,
        "conventions": rows,
    }
    show = partial(_print, rows, count)
    return publish(out / NAME, report, files, as_json=as_json, show=show)


def pictures_in(folder: Path) -> list[Path]:
    """Return the pictures in a folder and all folders in it, in order. Raises UsageError."""
    if not folder.is_dir():
        raise UsageError(f"{why_no_folder(folder)}; give one with pictures")
    folders = sorted({folder, *(path for path in folder.rglob("*") if path.is_dir())})
    return [path for each in folders for path in list_files(each)]


def fates_of(recogniser: PictureRecogniser, paths: Iterable[Path]) -> dict[str, Counter[Fate]]:
    """Count what becomes of each decision under each convention."""
    fates: dict[str, Counter[Fate]] = {name: Counter() for name in CONVENTIONS}
    for path in paths:
        with Image.open(path) as file:
            image = file.convert("RGB")
        image.thumbnail((SIDE, SIDE))
        plain = recogniser.recognise(image).material
        if plain == UNKNOWN:
            continue
        for name, convention in CONVENTIONS.items():
            fates[name][fate_of(plain, recogniser.recognise(convention(image)).material)] += 1
    return fates


def fate_of(before: str, after: str) -> Fate:
    """Return what became of a decision."""
    if after == before:
        return "kept"
    return "unknown" if after == UNKNOWN else "another"


def draw(fates: Mapping[str, Counter[Fate]], count: int, stem: Path) -> list[Path]:
    """Write `stem`.png and .svg: a bar for each convention; return both."""
    names = sorted(fates, key=lambda name: fates[name]["kept"])
    with figures.figure(stem, (WIDTH_IN, 1.2 + ROW_IN * len(names)), 1) as (drawn, (axes,)):
        left = np.zeros(len(names))
        for fate, colour in FATES:
            share = np.array([100.0 * fates[name][fate] / count for name in names])
            axes.barh(names, share, left=left, color=colour, label=fate)
            left += share
        axes.set(xlabel="% of decisions", xlim=(0, 100))
        figures.title(drawn, f"{count} decisions, as pictures are taken and shown otherwise")
        drawn.legend(loc="upper right", ncols=len(FATES), frameon=False)
    return figures.files(stem)


def _print(rows: Mapping[str, Mapping[Fate, int]], count: int) -> None:
    print(f"{count} decisions      kept  unknown  another")
    for name, row in rows.items():
        print(f"{name:20s} {row['kept']:5d} {row['unknown']:8d} {row['another']:8d}")
