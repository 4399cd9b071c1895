"""`hapticvlm chart beliefs`: what beliefs from pictures are worth, as a picture.

Two panels: how much is named against how much of it is right, as the belief asked for rises; and
the mean error of the contact temperature rendered when nothing, the best guess or a graded feel is
rendered. Sets and enrolment as `hapticvlm measure beliefs` has them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hapticvlm.palette import BLUE, GREEN, INK, PURPLE, SOFT, VERMILION
from hapticvlm.vision.encoders.loading import load_encoder
from hapticvlm.vision.galleries.gallery import Gallery
from hapticvlm.vision.galleries.storage import load_gallery
from hapticvlm_lab.bench import figures
from hapticvlm_lab.bench.material import belief_sets, beliefs
from hapticvlm_lab.bench.material.data import FOUR
from hapticvlm_lab.bench.printing import publish

if TYPE_CHECKING:
    from matplotlib.axes import Axes

NAME = "chart-beliefs"
SIZE_IN = (9.0, 4.4)
LEAST_COUNT = 12  # pictures: a share of fewer means nothing
REFERENCES = 5
COLOURS = (BLUE, VERMILION, GREEN, PURPLE)
METHODS = (("neutral_c", "neutral"), ("guess_c", "best guess"), ("graded_c", "as rendered"))

Doubles = NDArray[np.float64]
Curve = list[tuple[float, float]]


@dataclass(frozen=True, slots=True)
class Worth:
    """One set: curves of (share named, share of that right), and mean errors in degC."""

    name: str
    pictures: int
    curves: Mapping[str, Curve]
    errors_c: Mapping[str, float]


def run(data: Path | None, out: Path, *, as_json: bool) -> int:
    """Judge every set, and write picture and figures to `out`.

    Raises CaptureError, EncoderError, GalleryError, OSError.
    """
    encoder = load_encoder()
    found = []
    gallery = load_gallery(encoder=encoder)
    for source, kind in belief_sets.sources_of(data):
        found.append(worth(belief_sets.embed(encoder, source.keep(FOUR), kind), gallery))
    written = draw(found, encoder.name, out / NAME)
    results = {
        "encoder": encoder.name,
        "sets": [_as_json(each) for each in found],
        "files": [str(path) for path in written],
    }
    return publish(out / f"{NAME}.json", results, as_json=as_json, show=lambda: None)


def worth(seen: belief_sets.Seen, gallery: Gallery) -> Worth:
    """Judge one set, zero-shot and with REFERENCES enrolled where it has enough objects."""
    zero = belief_sets.among(gallery.beliefs(seen.first), gallery.candidates)
    curves = {"zero-shot": coverage(zero, seen.truth)}
    drawn = belief_sets.drawn(seen, gallery, REFERENCES)
    if drawn is not None:
        curves[f"{REFERENCES} references"] = coverage(drawn[0], seen.truth[drawn[1]])
    errors_c = beliefs.contact_error(zero, seen.truth, seen.objects)
    return Worth(
        seen.name,
        len(seen.truth),
        curves,
        {method: float(str(errors_c[method])) for method, _ in METHODS},
    )


def coverage(found: Doubles, truth: NDArray[np.int64]) -> Curve:
    """Share named and share of that right, of (N, C) beliefs, for every belief asked for."""
    surest = np.argsort(-found.max(axis=1), kind="stable")
    right = (found.argmax(axis=1) == truth)[surest]
    counts = np.arange(1, len(right) + 1)
    shares = np.cumsum(right) / counts
    steps = np.unique(np.linspace(min(LEAST_COUNT, len(right)), len(right), 60).astype(int)) - 1
    return [(float(counts[at] / len(right)), float(shares[at])) for at in steps]


def draw(found: list[Worth], encoder: str, stem: Path) -> list[Path]:
    """Draw the panels into `stem`.png and .svg; return both."""
    with figures.figure(stem, SIZE_IN, 2) as (drawn, (said, felt)):
        figures.title(drawn, f"{encoder}: wood, glass, fabric or metal?")
        _draw_coverage(said, found)
        _draw_error(felt, found)
    return figures.files(stem)


def _draw_coverage(axes: Axes, found: list[Worth]) -> None:
    for result, colour in zip(found, COLOURS, strict=False):
        for (title, curve), style in zip(result.curves.items(), ("-", "--"), strict=False):
            x, y = np.array(curve).T * 100
            axes.plot(
                x, y, style, color=colour, label=f"{result.name} ({result.pictures}), {title}"
            )
    axes.axhline(25, color=INK, linewidth=0.8, linestyle=":")
    axes.set(xlim=(0, 101), ylim=(0, 101), xlabel="said, % of pictures", ylabel="right, % of said")
    axes.set_title("The surest first; dotted: chance")
    axes.legend(fontsize=7, loc="lower left")


def _draw_error(axes: Axes, found: list[Worth]) -> None:
    places = np.arange(len(found))
    width = 0.27
    for number, ((method, title), colour) in enumerate(
        zip(METHODS, (SOFT, *COLOURS), strict=False)
    ):
        heights = [result.errors_c[method] for result in found]
        axes.bar(places + (number - 1) * width, heights, width, color=colour, label=title)
    axes.set_xticks(places, [result.name.replace("/", "/\n") for result in found], fontsize=7)
    axes.set(ylabel="mean error of contact temperature, degC", ylim=(0, None))
    axes.set_title("Felt, zero-shot: skin 33, room 22 degC")
    axes.legend()


def _as_json(result: Worth) -> dict[str, object]:
    rounded = {
        title: [[round(share, 3), round(right, 3)] for share, right in curve]
        for title, curve in result.curves.items()
    }
    return {
        "name": result.name,
        "pictures": result.pictures,
        "curves": rounded,
        "felt_c": result.errors_c,
    }
