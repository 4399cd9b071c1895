"""Can a small map from a picture tell its climate? `python -m hapticvlm.training.climate --data D`.

Features (colours, the shipped encoder's embedding of the whole frame, both; the teacher's as a mark
that cannot ship) go through a logistic regression to the classes of climate_data, each source held
back in turn. Of the ways tried, the one that ships would be the one that does best without the
source it is judged on ("chosen"). It earns its place when it beats the best constant of hindsight
in share right and in error, by intervals above zero. Beside it, what a split by picture claims.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hapticvlm.recognition.encoder import load_encoder
from hapticvlm.training import climate_data, climate_score
from hapticvlm.training.climate_data import Place
from hapticvlm.training.climate_score import Places, Told
from hapticvlm.training.teacher import Teacher

FOLDS = 5  # of the split by picture
ALL = "all labels"
CAPTURE = Path(__file__).parents[3] / "examples" / "captures" / "living_room"
LEAST_SOURCES = 3
MARK = "teacher"  # features that are compared with and cannot ship


Row = dict[str, object]


@dataclass(frozen=True, slots=True)
class Trial:
    """One way to do it: which features, which labels, and how classes are weighed."""

    features: str
    labels: str
    classes_alike: bool

    @property
    def title(self) -> str:
        """Name the trial in a line of the table."""
        weights = "classes alike" if self.classes_alike else "pictures alike"
        return f"{self.features}, {self.labels}, {weights}"

    @property
    def can_ship(self) -> bool:
        """Whether it speaks of all labels, by features that the service has."""
        return self.features != MARK and self.labels == ALL


def main(arguments: Sequence[str] | None = None) -> int:
    """Read the pictures, print the tables and a last line of JSON; 2 when there is no data."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, required=True, help="folder of labels.csv")
    parser.add_argument("--capture", type=Path, default=CAPTURE, help="of a room (%(default)s)")
    options = parser.parse_args(arguments)
    if not (options.data / "labels.csv").is_file():
        _say(f"no labels.csv in {options.data}: pass --data with the folder of labelled pictures")
        return 2
    found = list(climate_data.read_places(options.data))
    if options.capture.is_dir():
        found += climate_data.read_capture(options.capture)
    if len({place.source for place in found}) < LEAST_SOURCES:
        _say(f"fewer than {LEAST_SOURCES} sources: one is held back, two choose between ways")
        return 2
    features = _features(options.data, [place.image for place in found])
    trials = dict(_trials(found, features, climate_data.read_priors(options.data)))
    rows = [row for trial, places in trials.items() for row in _report(trial, places)]
    chosen = list(_chosen({t: p for t, p in trials.items() if t.can_ship}))
    earned = bool(chosen[0]["earns_its_place"])
    _say(f"\nthe learned estimate {'earns' if earned else 'does not earn'} its place")
    _say(json.dumps({"training": "climate", "earned": earned, "rows": rows + chosen}))
    return 0


def _features(data: Path, images: Sequence[climate_data.Pixels]) -> dict[str, NDArray[np.float32]]:
    """Describe the pictures in every way: name -> (N, F)."""
    colours = np.stack([climate_data.colour_features(image) for image in images])
    embeddings = climate_data.embed(images, load_encoder())
    found = {
        "colours": colours,
        "encoder": embeddings,
        "both": np.concatenate([colours, embeddings], axis=1),
    }
    if (data / "teacher").is_dir():
        squares = climate_data.squares(images, 224)
        masks = np.full(squares.shape[:3], 255, np.uint8)
        found[MARK] = Teacher(data).features(squares, masks)
    return found


def _trials(
    found: Sequence[Place],
    features: Mapping[str, NDArray[np.float32]],
    priors: Mapping[str, climate_data.Prior],
) -> Iterator[tuple[Trial, Places]]:
    truth = np.array([climate_data.class_of(place.label, priors) for place in found])
    middles = np.array([priors[place.label].middle_c for place in found])
    source = np.array([place.source for place in found])
    group = np.array([place.group for place in found])
    narrow = np.array([priors[place.label].is_narrow for place in found])
    for name, values in features.items():
        every = Places(values, truth, middles, source, group)
        for alike in (True, False):
            yield Trial(name, ALL, alike), every
            yield Trial(name, "narrow labels", alike), every.take(narrow)


def _report(trial: Trial, places: Places) -> Iterator[Row]:
    """Score one trial: pooled, by source, and by picture for contrast."""
    alike = trial.classes_alike
    said = climate_score.tell_held_back(places, places.source, classes_alike=alike)
    most = climate_score.most_right(places, places.source)
    _say(f"\n== {trial.title}; at most {most:.2f} could be right")
    yield from _by_source(trial.title, places, said)
    order = np.random.default_rng(climate_score.SEED).permutation(len(places.truth))
    leaky = climate_score.tell_held_back(places, (order % FOLDS).astype(str), classes_alike=alike)
    yield _row(trial.title, "by picture: leaks", places, leaky, climate_score.hindsight(places))


def _chosen(trials: Mapping[Trial, Places]) -> Iterator[Row]:
    """Score the trial that is chosen anew for every source, without looking at it."""
    _say("\n== chosen for each source by the others")
    places = next(iter(trials.values()))
    said = Told(np.zeros(len(places.truth), np.int64), np.zeros(len(places.truth)))
    for held in np.unique(places.source):
        among = places.source == held
        best = max(trials, key=lambda trial: _right_without(trials[trial].take(~among), trial))
        _say(f"  {held}: {best.title}")
        told = climate_score.tell_held_back(
            trials[best], places.source, classes_alike=best.classes_alike
        ).take(among)
        said.classes[among], said.value_c[among] = told.classes, told.value_c
    yield from _by_source("chosen", places, said)


def _right_without(places: Places, trial: Trial) -> float:
    """Share right of the pictures that are left, each source told by the others."""
    said = climate_score.tell_held_back(places, places.source, classes_alike=trial.classes_alike)
    return float((said.classes == places.truth).mean())


def _by_source(title: str, places: Places, said: Told) -> Iterator[Row]:
    yield _row(title, "pooled", places, said, climate_score.hindsight(places))
    learned = climate_score.learned(places, places.source)
    yield _row(title, "pooled, taught constant", places, said, learned)
    for source in np.unique(places.source):
        among = places.source == source
        part = places.take(among)
        yield _row(title, str(source), part, said.take(among), climate_score.hindsight(part))


def _row(title: str, split: str, places: Places, said: Told, constant: Told) -> Row:
    score = climate_score.compare(places, said, constant)
    right, error = score.right_gain, score.mae_c_gain
    _say(
        f"  {split:24} n {score.n:>3}  right {score.right:.2f} ({score.right_constant:.2f})"
        f" {right.mean:+.2f} [{right.low:+.2f}, {right.high:+.2f}]"
        f"  mae {score.mae_c:4.1f} ({score.mae_c_constant:.1f}; 22 degC {score.mae_c_default:.1f})"
        f" {error.mean:+.1f} [{error.low:+.1f}, {error.high:+.1f}]"
        f"  {', '.join(f'{name} {share}' for name, share in score.classes.items())}"
    )
    return {"trial": title, "split": split} | score.as_row()


def _say(line: str) -> None:
    sys.stdout.write(line + "\n")


if __name__ == "__main__":
    sys.exit(main())
