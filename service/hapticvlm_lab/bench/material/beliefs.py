"""`hapticvlm measure beliefs`: the worth of the beliefs that pictures give.

A belief is a probability for each material. Three questions are asked of it, on pictures that
taught, chose and calibrated nothing, with wood, glass, fabric and metal admitted.

How often does it name a material, and how often rightly? A material is named if its belief is above
one half, which is the threshold at which a wrong name costs as much as silence.

Is it calibrated where it matters, in what is felt? The service renders the material of least
expected felt error, and for studies an expectation over all beliefs. The errors of their contact
temperatures are compared with that of the best constant: a belief that is not better than a
constant is of no use to a hand.

What do a few references change? Some of the set's own pictures are enrolled as `gallery build
--base shipped` does, or objects that the scene names teach the others of their scene.

Intervals are 95 % bootstraps over objects, since the pictures of one object are wrong together.
References and named objects are never of the object judged.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hapticvlm.evidence.ladder import Evidence
from hapticvlm.materials import MATERIALS, Thermal
from hapticvlm.rendering.expectation import expected_thermal, needed_belief
from hapticvlm.rendering.felt_error import least_felt_error
from hapticvlm.rendering.heat import contact as thermal
from hapticvlm.vision import pictures
from hapticvlm.vision.encoders.encoder import Encoder
from hapticvlm.vision.encoders.loading import load_encoder
from hapticvlm.vision.flatness import is_flat
from hapticvlm.vision.galleries import calibration, enrol
from hapticvlm.vision.galleries.gallery import Gallery
from hapticvlm.vision.galleries.storage import load_gallery
from hapticvlm.vision.scene_references import SceneReferences
from hapticvlm_lab.bench.material.data import FOUR, Source
from hapticvlm_lab.bench.material.reading import Kind, sources_of

DRAWS = 20
SEED = 7
ALL = tuple(MATERIALS)
REFERENCES = (5, 20)
NAMED = 5  # objects of a scene that teach
RESAMPLES = 1000
ROOM_C = 22.0

Floats = NDArray[np.float32]
Doubles = NDArray[np.float64]

_SHOWN = ("said", "right", "startling", "startling_right", "forced")


@dataclass(frozen=True, slots=True)
class Seen:
    """Pictures of some materials: truth (N,) as places in names, objects (N,), views of each.

    flat: (N,), which have flat colours.
    """

    name: str
    pictures: Kind
    truth: NDArray[np.int64]
    objects: NDArray[np.str_]
    views: tuple[Floats, ...]
    flat: NDArray[np.bool_]

    @property
    def first(self) -> Floats:
        """The unvaried view of each picture, (N, D)."""
        return np.stack([rows[0] for rows in self.views])


def run(data: Path | None, encoder_name: str | None, path: Path | None, *, as_json: bool) -> int:
    """Print a table for each set as it is ready, or JSON; `path` is a gallery.

    Raises CaptureError, EncoderError, GalleryError.
    """
    encoder = load_encoder(encoder_name)
    report: dict[str, object] = {"encoder": encoder.name}
    gallery = load_gallery(path, encoder=encoder)
    for source, kind in sources_of(data):
        judged = judge(embed(encoder, source.keep(FOUR), kind), gallery)
        judged["all materials"] = _among_all(embed(encoder, source.keep(ALL), kind, ALL), gallery)
        report[source.name] = judged
        if not as_json:
            _print(source.name, report[source.name])
    if as_json:
        print(json.dumps(report))
    return 0


def judge(seen: Seen, gallery: Gallery) -> dict[str, object]:
    """Return every figure of one set."""
    zero = among(gallery.beliefs(seen.first, seen.flat), gallery.candidates)
    figures: dict[str, object] = {"zero-shot": spoken(zero, seen.truth, seen.objects)}
    figures["zero-shot, fused"] = _fused(zero, seen)
    errors: dict[str, object] = {"zero-shot": contact_error(zero, seen.truth, seen.objects)}
    for count in REFERENCES:
        name = f"{count} references"
        draws = drawn(seen, gallery, count)
        if draws is not None:
            beliefs, rows = draws
            figures[name] = spoken(beliefs, seen.truth[rows], seen.objects[rows])
            errors[name] = contact_error(beliefs, seen.truth[rows], seen.objects[rows])
    taught = _scene_taught(seen, zero) if seen.pictures == "renders" else None
    return {"pictures": len(seen.truth), "said": figures, "felt": errors, "scene-taught": taught}


def _among_all(seen: Seen, gallery: Gallery) -> dict[str, object]:
    """Judge pictures of any material, with every material admitted."""
    beliefs = among(gallery.beliefs(seen.first, seen.flat), gallery.candidates, ALL)
    there = [name for place, name in enumerate(ALL) if place in seen.truth]
    return {
        "pictures": len(seen.truth),
        "materials": there,
        "said": spoken(beliefs, seen.truth, seen.objects),
    }


def spoken(
    beliefs: Doubles, truth: NDArray[np.int64], objects: NDArray[np.str_]
) -> dict[str, object]:
    """Return share named, share of that right, and accuracy of the forced choice, with intervals.

    A wrong name costs as much as silence at a belief of one half, and twice as much at two thirds
    (`startling`): these are the two thresholds. In the forced choice classes count equally.
    """
    right = beliefs.argmax(axis=1) == truth
    speaks = beliefs.max(axis=1) > 1 / 2
    startles = beliefs.max(axis=1) > 2 / 3
    forced: Callable[[NDArray[np.int64]], float] = lambda rows: _balanced(right[rows], truth[rows])  # noqa: E731
    return {
        "said": _interval(lambda rows: float(speaks[rows].mean()), objects),
        "right": _interval(lambda rows: _mean(right[rows][speaks[rows]]), objects),
        "startling": _interval(lambda rows: float(startles[rows].mean()), objects),
        "startling_right": _interval(lambda rows: _mean(right[rows][startles[rows]]), objects),
        "mean_confidence": round(float(beliefs.max(axis=1).mean()), 3),
        "forced": _interval(forced, objects),
    }


def contact_error(
    beliefs: Doubles, truth: NDArray[np.int64], objects: NDArray[np.str_]
) -> dict[str, object]:
    """Return mean errors of the contact temperature, degC, and the share saved over a constant.

    Classes count equally. `neutral` is the mean contact temperature of the four, which is the best
    constant then.
    """
    # The error is that of the contact temperature, since a wrong material is felt there: wood taken
    # for fabric errs by about a degree, metal taken for fabric by several.
    contacts = np.array([_contact_c(MATERIALS[name].thermal) for name in FOUR])
    graded = np.abs(np.array([_graded_c(row, contacts) for row in beliefs]) - contacts[truth])
    ours = np.abs(np.array([_felt_c(row, contacts) for row in beliefs]) - contacts[truth])
    neutral = np.abs(contacts.mean() - contacts[truth])
    guess = np.abs(contacts[beliefs.argmax(axis=1)] - contacts[truth])

    def gain(rows: NDArray[np.int64]) -> float:
        return 1.0 - _balanced(ours[rows], truth[rows]) / _balanced(neutral[rows], truth[rows])

    every = np.arange(len(truth))
    return {
        "guess_c": round(_balanced(guess[every], truth), 3),
        "felt_c": round(_balanced(ours[every], truth), 3),
        "graded_c": round(_balanced(graded[every], truth), 3),
        "neutral_c": round(_balanced(neutral[every], truth), 3),
        "below_neutral": _interval(gain, objects),
    }


def _felt_c(beliefs: Doubles, contacts: Doubles) -> float:
    """Render as the product does: the material of least expected felt error."""
    named = dict(zip(FOUR, beliefs.tolist(), strict=True))
    return float(contacts[FOUR.index(least_felt_error(named, MATERIALS))])


def _graded_c(beliefs: Doubles, contacts: Doubles) -> float:
    """Render as with `--feel graded`: the material if it is sure enough, else the expectation."""
    # A wrong material is felt by its distance from the right one, so the belief that is needed to
    # render a material grows with its distance from the expectation.
    named = dict(zip(FOUR, beliefs.tolist(), strict=True))
    expected_c = _contact_c(expected_thermal(named, MATERIALS))
    best = int(beliefs.argmax())
    is_sure = beliefs[best] > needed_belief(None, float(contacts[best]) - expected_c)
    return float(contacts[best]) if is_sure else expected_c


def _contact_c(bulk: Thermal) -> float:
    return thermal.contact_temperature_c(thermal.thermal_contact(bulk, ROOM_C))


def _scene_taught(seen: Seen, zero: Doubles) -> dict[str, object]:
    """Name NAMED objects at random; judge all others without and with their help."""
    # The named objects are drawn at random DRAWS times. Only the other objects are judged, each
    # with the references that the named ones of its scene give.
    rng = np.random.default_rng([SEED, NAMED])
    names = np.unique(seen.objects)
    before = []
    after = []
    rows = []
    for _ in range(DRAWS):
        named = rng.permutation(names)[:NAMED]
        references = SceneReferences()
        for row in np.flatnonzero(np.isin(seen.objects, named)):
            label = FOUR[seen.truth[row]]
            references.add(str(seen.objects[row]), label, seen.views[row][0])
        for row in np.flatnonzero(~np.isin(seen.objects, named)):
            evidence = Evidence("encoder", tuple(zip(FOUR, zero[row].tolist(), strict=True)))
            adjusted = references.adjust(
                evidence, seen.views[row][0], str(seen.objects[row]), is_flat=bool(seen.flat[row])
            )
            before.append(zero[row].argmax() == seen.truth[row])
            after.append(adjusted.material == FOUR[seen.truth[row]])
            rows.append(row)
    place = np.array(rows)
    gains = np.array(after, float) - np.array(before, float)
    return {
        "named": NAMED,
        "without": _interval(lambda at: float(np.array(before)[at].mean()), seen.objects[place]),
        "with": _interval(lambda at: float(np.array(after)[at].mean()), seen.objects[place]),
        "gain": _interval(lambda at: float(gains[at].mean()), seen.objects[place]),
    }


def _fused(beliefs: Doubles, seen: Seen) -> dict[str, object]:
    names = np.unique(seen.objects)
    rows = [seen.objects == name for name in names]
    means = np.stack([beliefs[row].mean(axis=0) for row in rows])
    return spoken(means, np.array([seen.truth[row][0] for row in rows]), names)


def _interval(
    figure: Callable[[NDArray[np.int64]], float], objects: NDArray[np.str_]
) -> list[float]:
    """Return a figure of all rows with its 95 % bootstrap over objects: value, low, high.

    Objects are drawn with replacement, each with all of its pictures, and the figure is computed
    again for each draw; the interval holds the middle 95 % of these.
    """
    # The same draws for every figure: two figures of one set then differ by themselves and not by
    # the luck of their draws.
    rng = np.random.default_rng(SEED)
    names, place = np.unique(objects, return_inverse=True)
    rows = [np.flatnonzero(place == number) for number in range(len(names))]
    draws = [rng.integers(0, len(names), len(names)) for _ in range(RESAMPLES)]
    resampled = [figure(np.concatenate([rows[number] for number in draw])) for draw in draws]
    low, high = np.nanpercentile(resampled, (2.5, 97.5))
    every = figure(np.arange(len(objects)))
    return [round(float(value), 3) for value in (every, low, high)]


def _balanced(values: NDArray[np.generic], truth: NDArray[np.int64]) -> float:
    return float(np.mean([np.mean(values[truth == label]) for label in np.unique(truth)]))


def _mean(values: NDArray[np.bool_]) -> float:
    return float(values.mean()) if values.size else float("nan")


def _print(name: str, report: object) -> None:
    assert isinstance(report, dict)
    print(f"\n{name}: {report['pictures']} pictures of {', '.join(FOUR)}")
    for title, row in report["said"].items():
        cells = [f"{key} {_percent(row[key])}" for key in _SHOWN]
        print(f"  {title:<20} {'  '.join(cells)}")
    for title, row in report["felt"].items():
        text = f"{row['felt_c']} degC, graded {row['graded_c']}, neutral {row['neutral_c']}"
        print(f"  felt, {title:<14} {text}, below neutral {_percent(row['below_neutral'])}")
    if report["scene-taught"] is not None:
        _print_taught(report["scene-taught"])
    every = report["all materials"]
    cells = [f"{key} {_percent(every['said'][key])}" for key in _SHOWN]
    there = f"{every['pictures']} pictures of {', '.join(every['materials'])}"
    print(f"  all {len(ALL)} admitted, {there}:")
    print(f"  {'zero-shot':<20} {'  '.join(cells)}")


def _print_taught(row: Mapping[str, Sequence[float]]) -> None:
    cells = [f"{key} {_percent(row[key])}" for key in ("without", "with", "gain")]
    print(f"  {row['named']} objects named: {'  '.join(cells)}")


def _percent(interval: Sequence[float]) -> str:
    value, low, high = (f"{100 * number:.0f}" for number in interval)
    return f"{value} [{low}, {high}] %"


def embed(encoder: Encoder, source: Source, kind: Kind, names: Sequence[str] = FOUR) -> Seen:
    """Embed pictures of these materials, each as it is and varied as enrolment does."""
    views = []
    flat = []
    for view in source.views:
        frame = view.as_cut(source.cut)
        try:
            cut = enrol.views(enrol.Picture(view.truth, Path(view.object_id)), frame, encoder.side)
        except enrol.EnrolError:  # one plain colour: recognised all the same
            cut = [pictures.crop(frame, encoder.side)]
        flat.append(is_flat(cut[0]))
        cut = cut if kind == "renders" else cut[:1]
        views.append(np.concatenate([encoder.embed([crop]) for crop in cut]))
    truth = np.array([names.index(name) for name in source.truth])
    return Seen(source.name, kind, truth, source.objects, tuple(views), np.array(flat, np.bool_))


def among(beliefs: Doubles, names: Sequence[str], admitted: Sequence[str] = FOUR) -> Doubles:
    """Restrict (N, C) beliefs to the M admitted, (N, M); the share of unknown keeps its scale."""
    kept = beliefs[:, [names.index(name) for name in admitted]]
    # Beliefs in materials that are not admitted are dropped. What is left is divided by its own sum
    # together with unknown, so that it stays a probability: dropping a rival raises the others.
    unknown = 1.0 - beliefs.sum(axis=1, keepdims=True)
    return np.asarray(kept / (kept.sum(axis=1, keepdims=True) + np.maximum(unknown, 0.0)))


def drawn(seen: Seen, gallery: Gallery, count: int) -> tuple[Doubles, NDArray[np.int64]] | None:
    """Enrol `count` pictures a class, DRAWS times; return beliefs of other objects, and rows."""
    rng = np.random.default_rng([SEED, count])
    beliefs_drawn = []
    rows = []
    for _ in range(DRAWS):
        chosen = _draw(seen, count, rng)
        if chosen is None:
            return None
        rest = np.flatnonzero(~np.isin(seen.objects, seen.objects[chosen]))
        user = enrolled(seen, chosen, gallery)
        beliefs = replace(gallery, user=user).beliefs(seen.first[rest], seen.flat[rest])
        beliefs_drawn.append(among(beliefs, gallery.candidates))
        rows.append(rest)
    return np.concatenate(beliefs_drawn), np.concatenate(rows)


def enrolled(seen: Seen, chosen: NDArray[np.int64], gallery: Gallery) -> Gallery:
    """Build a gallery of these pictures, calibrated as `gallery build` does."""
    views = [seen.views[row] for row in chosen]
    places = np.repeat(np.arange(len(views)), [len(rows) for rows in views])
    labels = seen.truth[chosen][places]
    own = Gallery(
        gallery.encoder, FOUR, np.concatenate(views), labels, calibration.FEW, places=places
    )
    return replace(own, calibration=calibration.calibrate(own, gallery))


def _draw(seen: Seen, count: int, rng: np.random.Generator) -> NDArray[np.int64] | None:
    """Draw `count` pictures a class, of as many objects as possible, of half of them at most."""
    # One picture of each object first, then a second of each: references of many objects teach a
    # material, those of one object teach that object.
    chosen: list[int] = []
    for label in range(len(FOUR)):
        objects = rng.permutation(np.unique(seen.objects[seen.truth == label]))
        if len(objects) < 2:
            return None
        of = [rng.permutation(np.flatnonzero(seen.objects == name)) for name in objects]
        queue = [
            int(row) for turn in _turns(of[: max(1, min(count, len(of) // 2))]) for row in turn
        ]
        chosen += queue[:count]
    return np.array(chosen)


def _turns(groups: Sequence[NDArray[np.int64]]) -> list[list[int]]:
    longest = max(len(group) for group in groups)
    return [[int(g[turn]) for g in groups if turn < len(g)] for turn in range(longest)]
