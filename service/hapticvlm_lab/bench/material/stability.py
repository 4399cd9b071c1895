"""`hapticvlm stability material`: the losses of the default as its pictures get worse, by degrees.

Every perturbation of `perturb.SHAKES` is applied to the same pictures of each source. For each
severity: accuracy among FOUR; the share of answers that differ from those to the clean picture
(flips); the share that is wrong and sure.

A method breaks at the severity where half of its lead over chance is lost. Chance among four
classes is 25 %, so a method that is right in 85 % of the clean pictures breaks at 55 %.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from hapticvlm.commands.progress import track
from hapticvlm.evidence.ladder import SURE
from hapticvlm.palette import BLUE, GREEN, SOFT, VERMILION
from hapticvlm.vision.encoders.encoder import Encoder
from hapticvlm.vision.flatness import is_flat
from hapticvlm.vision.galleries.gallery import Gallery
from hapticvlm.vision.galleries.storage import load_gallery
from hapticvlm.vision.loading import load_encoder
from hapticvlm.vision.pictures import crop
from hapticvlm_lab.bench import figures
from hapticvlm_lab.bench.material.data import FOUR, Source, Where, thin
from hapticvlm_lab.bench.material.perturb import SHAKES, Shake, apply
from hapticvlm_lab.bench.material.picture import Picture, as_frame, window
from hapticvlm_lab.bench.material.reading import load_sources
from hapticvlm_lab.bench.material.scores import Words, score
from hapticvlm_lab.bench.printing import publish

if TYPE_CHECKING:
    from matplotlib.axes import Axes

NAME = "stability-material"
CHANCE = 0.25  # of four classes
LEAD = 0.05  # over chance below which there is nothing to lose
VIEWS = 2  # of an object, far and near; more where a source has few objects

Floats = NDArray[np.float32]
Flags = NDArray[np.bool_]
WIDTH_IN = 12.0
PANEL_IN = 2.5
COLUMNS = 4
LINES = (  # field, label, colour, line and marker
    ("accuracy", "right of 4", BLUE, "-o"),
    ("flips", "answer changed", GREEN, "--^"),
    ("wrong_and_sure", "wrong and sure", VERMILION, ":x"),
)


@dataclass(frozen=True, slots=True)
class Default:
    """The encoder and gallery that the service uses by default."""

    encoder: Encoder
    gallery: Gallery

    def embed(self, pictures: Sequence[Picture]) -> tuple[Floats, Flags]:
        """Embed the frames that a client would send: (N, D), and which are flat: (N,)."""
        crops = [crop(as_frame(picture), self.encoder.side) for picture in pictures]
        return self.encoder.embed(crops), np.array([is_flat(each) for each in crops], np.bool_)


@dataclass(frozen=True, slots=True)
class Predictions:
    """Predictions for N pictures: among FOUR, among all, and the confidence in the latter."""

    forced: Words
    likeliest: Words
    confidence: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Clean:
    """The unchanged pictures of a source, their embeddings and predictions."""

    pictures: tuple[Picture, ...]
    truth: Words
    objects: Words
    seeds: tuple[int, ...]
    embeddings: Floats
    flat: Flags
    predictions: Predictions


@dataclass(frozen=True, slots=True)
class Step:
    """One severity: balanced accuracy among four with its interval; shares of pictures.

    flips: answers that differ from the clean picture's. wrong_and_sure: named with confidence, and
    wrong.
    """

    severity: float
    accuracy: float
    low: float
    high: float
    flips: float
    wrong_and_sure: float


@dataclass(frozen=True, slots=True)
class Curve:
    """A perturbation's steps, clean first; n pictures."""

    name: str
    unit: str
    n: int
    steps: tuple[Step, ...]

    def breaks_at(self) -> float | None:
        """Return the severity where half of the lead over chance is lost; None if it never is."""
        lead = [step.accuracy - CHANCE for step in self.steps]
        if lead[0] < LEAD:
            return None
        half = lead[0] / 2
        # Between two severities the lead is taken as linear.
        for (before, after), (low, high) in zip(pairwise(lead), pairwise(self.steps), strict=True):
            if after <= half:
                share = (before - half) / (before - after)
                return low.severity + share * (high.severity - low.severity)
        return None


def run(where: Where, out: Path, *, as_json: bool) -> int:
    """Perturb every source. Raises what loading raises."""
    readable, skipped = load_sources(replace(where, limit=0))
    sources = [_thinned(source.keep(FOUR), where.limit) for source in readable]
    encoder = load_encoder()
    default = Default(encoder, load_gallery(encoder=encoder))
    results: dict[str, list[Curve]] = {}
    for source in track(sources, "perturbing each source"):
        results[source.name] = shake_source(source, default)
        if not as_json:
            print(f"\n== {source.name}, {len(source.views)} pictures")
            print("\n".join(f"  {sentence(curve)}" for curve in results[source.name]))
    files = [path for name in results for path in draw(name, results[name], out / NAME)]
    report = _report(encoder, results, skipped)
    ended = "\n".join(f"skipped  {text}" for text in skipped)
    return publish(out / NAME, report, files, as_json=as_json, show=partial(print, ended))


def shake_source(source: Source, default: Default) -> list[Curve]:
    """Apply every perturbation at all severities."""
    clean = predict_clean(source, default)
    return [shaken(clean, shake, default) for shake in SHAKES if _concerned(clean, shake).any()]


def predict_clean(source: Source, default: Default) -> Clean:
    """Decode a source's pictures and predict their materials as they are."""
    pictures = [window(view) for view in source.views]
    shown = tuple(
        replace(picture, behind=_another(pictures, source.truth, at).image)
        for at, picture in enumerate(pictures)
    )
    seeds = tuple(crc32(f"{view.object_id}/{at}".encode()) for at, view in enumerate(source.views))
    embeddings, flat = default.embed(shown)
    predictions = _ask(embeddings, flat, default.gallery)
    return Clean(shown, source.truth, source.objects, seeds, embeddings, flat, predictions)


def shaken(clean: Clean, shake: Shake, default: Default) -> Curve:
    """Apply one perturbation at all severities; severity 0 is the clean prediction."""
    rows = np.flatnonzero(_concerned(clean, shake))
    steps = []
    for severity in shake.severities:
        predictions = clean.predictions
        if severity:
            changed = list(clean.pictures)
            for row in rows:
                changed[row] = apply(shake, clean.pictures[row], severity, clean.seeds[row])
            embeddings = clean.embeddings.copy()
            flat = clean.flat.copy()
            embeddings[rows], flat[rows] = default.embed([changed[row] for row in rows])
            predictions = _ask(embeddings, flat, default.gallery)
        steps.append(_step(severity, predictions, clean, rows))
    return Curve(shake.name, shake.unit, len(rows), tuple(steps))


def _ask(embeddings: Floats, flat: Flags, gallery: Gallery) -> Predictions:
    beliefs = gallery.beliefs(embeddings, flat)
    names = np.array(gallery.candidates)
    among = np.where(np.isin(names, FOUR), beliefs, -np.inf)
    likeliest = names[beliefs.argmax(axis=1)]
    return Predictions(names[among.argmax(axis=1)], likeliest, beliefs.max(axis=1))


def _step(severity: float, predictions: Predictions, clean: Clean, rows: NDArray[np.intp]) -> Step:
    truth = clean.truth[rows]
    objects = clean.objects[rows]
    graded = score(predictions.forced[rows], truth, objects, FOUR)
    assert graded is not None
    wrong = (predictions.likeliest[rows] != truth) & (predictions.confidence[rows] >= SURE)
    return Step(
        severity=severity,
        accuracy=graded.accuracy,
        low=graded.low,
        high=graded.high,
        flips=float((predictions.forced[rows] != clean.predictions.forced[rows]).mean()),
        wrong_and_sure=float(wrong.mean()),
    )


def _thinned(source: Source, limit: int) -> Source:
    objects = len(set(source.objects.tolist())) or 1
    return thin(source, limit, max(VIEWS, limit // objects))


def _concerned(clean: Clean, shake: Shake) -> NDArray[np.bool_]:
    if shake.only is None:
        return np.ones(len(clean.truth), np.bool_)
    return np.asarray(clean.truth == shake.only)


def _another(pictures: Sequence[Picture], truth: Words, at: int) -> Picture:
    """Find a picture of the source that shows another class, if there is one."""
    others = np.flatnonzero(truth != truth[at])
    return pictures[others[(7 * at + 3) % len(others)] if len(others) else at]


def _report(
    encoder: Encoder,
    results: dict[str, list[Curve]],
    skipped: Sequence[str],
) -> dict[str, object]:
    return {
        "stability": "material",
        "encoder": encoder.name,
        "sources": {
            name: [asdict(curve) | {"breaks": sentence(curve)} for curve in curves]
            for name, curves in results.items()
        },
        "skipped": list(skipped),
    }


def sentence(curve: Curve) -> str:
    """Return where a curve breaks."""
    worst = curve.steps[-1]
    sure = max(step.wrong_and_sure for step in curve.steps)
    return (
        f"{curve.name}: {_loss(curve)}; flips {worst.flips:.0%} at {worst.severity:g}; "
        f"wrong and sure at most {sure:.0%} (n = {curve.n}, {curve.unit})"
    )


def _loss(curve: Curve) -> str:
    first = curve.steps[0].accuracy
    if first - CHANCE < LEAD:
        return f"has no lead to lose ({first:.0%} clean)"
    at = curve.breaks_at()
    if at is None:
        return f"keeps half its lead to {curve.steps[-1].severity:g} ({first:.0%} clean)"
    return f"loses half its lead at {at:.2g} ({first:.0%} clean)"


def draw(source: str, curves: Sequence[Curve], stem: Path) -> list[Path]:
    """Write `stem`-source.png and .svg; return both."""
    stem = stem.with_name(f"{stem.name}-{source}")
    rows = -(-len(curves) // COLUMNS)
    size_in = (WIDTH_IN, PANEL_IN * rows + 0.8)
    with figures.figure(stem, size_in, len(curves), COLUMNS, sharey=True) as (drawn, panels):
        for axes, curve in zip(panels, curves, strict=True):
            _panel(axes, curve)
        for axes in panels[::COLUMNS]:
            axes.set_ylabel("% of pictures")
        figures.title(drawn, f"{source}: the default as its pictures get worse")
        handles, texts = panels[0].get_legend_handles_labels()
        drawn.legend(handles, texts, loc="upper right", ncols=len(LINES) + 1, frameon=False)
    return figures.files(stem)


def _panel(axes: Axes, curve: Curve) -> None:
    at = [step.severity for step in curve.steps]
    low, high = ([100 * getattr(step, edge) for step in curve.steps] for edge in ("low", "high"))
    axes.fill_between(at, low, high, color=LINES[0][2], alpha=0.12, linewidth=0)
    for field, label, colour, style in LINES:
        values = [100 * float(getattr(step, field)) for step in curve.steps]
        axes.plot(at, values, style, color=colour, markersize=4, linewidth=1.4, label=label)
    axes.axhline(100 * CHANCE, color=SOFT, linewidth=0.8, linestyle="--", label="chance")
    breaks = curve.breaks_at()
    if breaks is not None:
        axes.axvline(breaks, color=LINES[0][2], linewidth=0.8, linestyle=":")
    axes.set(title=f"{curve.name} (n = {curve.n})", xlabel=curve.unit, xticks=at, ylim=(-3, 103))
