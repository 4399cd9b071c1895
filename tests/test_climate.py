"""The learned climate estimate: what labels mean, how it is judged, and why a leak is seen."""

import csv
import json

import numpy as np
import pytest
from PIL import Image

from hapticvlm.training import climate, climate_data, climate_score
from hapticvlm.training.climate_data import CLASSES, Prior
from hapticvlm.training.climate_score import Gain, Places, Told

PRIORS = {"snow": Prior(-15, 2), "rain": Prior(5, 25), "shine": Prior(20, 34)} | {
    "indoor": Prior(18, 25),
    "fog": Prior(0, 15),
}
RNG = np.random.default_rng(7)


def places(
    features: np.ndarray, truth: np.ndarray, source: np.ndarray, place: np.ndarray | None = None
) -> Places:
    middles = np.array([-6.5, 7.5, 15.0, 27.0, 33.0, 21.5])[truth]
    names = np.arange(len(truth)).astype(str) if place is None else place
    return Places(features.astype(np.float32), truth, middles, source, names)


def sources_that_look_alike_inside(n: int = 40) -> Places:
    """Three sources of two classes each, told apart by their source's look and nothing else."""
    source = np.repeat(["a", "b", "c"], n)
    truth = np.concatenate([np.full(n, 2), np.full(n, 5), RNG.choice([2, 5], n)])
    look = np.repeat(RNG.normal(size=(3, 6)), n, axis=0)
    return places(look + 0.1 * RNG.normal(size=(3 * n, 6)), truth, source)


@pytest.mark.parametrize(
    ("label", "name"),
    [("snow", "freezing"), ("fog", "cold"), ("rain", "mild"), ("indoor", "indoor")],
)
def test_a_label_is_of_the_class_its_middle_lies_in(label: str, name: str) -> None:
    assert CLASSES[climate_data.class_of(label, PRIORS)] == name


def test_no_label_is_hot_and_wide_ones_say_little() -> None:
    assert "hot" not in {CLASSES[climate_data.class_of(label, PRIORS)] for label in PRIORS}
    assert PRIORS["shine"].is_narrow
    assert not PRIORS["rain"].is_narrow


def test_a_view_looks_where_it_is_turned() -> None:
    panorama = np.zeros((32, 64, 3), np.float32)
    panorama[:, 14:18, 0] = 1.0  # a red column a quarter turn away
    seen = climate_data.view(panorama, 0.25, side=32)
    assert seen.shape == (32, 32, 3)
    assert seen[16, 16, 0] == 255
    assert climate_data.view(panorama, 0.75, side=32).max() == 0


def test_colour_features_are_finite_and_tell_a_dark_picture_from_a_blue_one() -> None:
    dark = climate_data.colour_features(np.zeros((50, 70, 3), np.uint8))
    blue = climate_data.colour_features(np.full((90, 40, 3), (40, 90, 220), np.uint8))
    assert dark.shape == blue.shape
    assert np.isfinite([dark, blue]).all()
    assert np.abs(dark - blue).max() > 0.5


@pytest.mark.parametrize("alike", [True, False])
def test_what_can_be_told_apart_is_told_apart(alike: bool) -> None:
    truth = np.repeat([2, 3], 30)
    features = np.column_stack([truth + 0.1 * RNG.normal(size=60), RNG.normal(size=60)])
    tell = climate_score.fit(features.astype(np.float32), truth, classes_alike=alike)
    assert (tell(features.astype(np.float32)) == truth).mean() > 0.95


def test_a_map_that_learned_its_sources_is_found_out_only_when_they_are_held_back() -> None:
    found = sources_that_look_alike_inside()
    order = (np.arange(len(found.truth)) % 5).astype(str)
    leaky = climate_score.tell_held_back(found, order, classes_alike=True)
    honest = climate_score.tell_held_back(found, found.source, classes_alike=True)
    best = climate_score.hindsight(found)
    assert climate_score.compare(found, leaky, best).earns_its_place
    assert not climate_score.compare(found, honest, best).earns_its_place


def test_what_is_true_across_sources_earns_its_place() -> None:
    truth = np.tile([2, 5], 60)
    signal = truth[:, None] + 0.3 * RNG.normal(size=(120, 3))
    found = places(signal, truth, np.repeat(["a", "b", "c"], 40))
    said = climate_score.tell_held_back(found, found.source, classes_alike=True)
    assert climate_score.compare(found, said, climate_score.hindsight(found)).earns_its_place


def test_a_class_of_too_few_pictures_is_not_taught() -> None:
    few = climate_score.LEAST_TAUGHT - 1
    truth = np.concatenate([np.full(40, 2), np.full(few, 0)])
    features = truth[:, None] + 0.01 * RNG.normal(size=(len(truth), 2))
    found = places(features, truth, np.tile(["a", "b"], len(truth))[: len(truth)])
    said = climate_score.tell_held_back(found, found.source, classes_alike=True)
    assert set(said.classes) == {2}
    assert climate_score.most_right(found, found.source) == pytest.approx(40 / len(truth))


def test_the_constant_of_hindsight_is_the_best_one() -> None:
    truth = np.array([2, 2, 2, 5, 3])
    found = places(np.zeros((5, 1)), truth, np.array(["a"] * 5))
    best = climate_score.hindsight(found)
    assert (best.classes == 2).all()
    assert (best.value_c == np.median(found.middle_c)).all()


def test_many_views_of_one_place_are_no_more_certain_than_one() -> None:
    differences = np.tile([1.0, 0.0, 1.0, 0.0, 1.0, 1.0], 20)
    each = climate_score.gain(differences, np.arange(120).astype(str))
    six = climate_score.gain(differences, np.tile(np.arange(6).astype(str), 20))
    assert six.mean == each.mean
    assert six.high - six.low > 2 * (each.high - each.low)


def test_one_gain_of_two_is_not_enough() -> None:
    truth = np.repeat([2, 5], 20)
    found = places(np.zeros((40, 1)), truth, np.array(["a"] * 40))
    right = Told(truth, np.full(40, 90.0))  # every class right, every temperature absurd
    score = climate_score.compare(found, right, climate_score.hindsight(found))
    assert score.right_gain.low > 0.0
    assert not score.earns_its_place
    assert isinstance(score.mae_c_gain, Gain)


def test_the_command_prints_a_table_and_a_last_line_of_json(tmp_path, capsys) -> None:
    rows = []
    for number in range(72):
        label = ("rain", "shine")[number % 2]
        source = ("Multi-class", "robocasa", "AlexandreSajus")[number // 24]
        path = f"weather/{number}.png"
        (tmp_path / "weather").mkdir(exist_ok=True)
        pixels = RNG.integers(0, 60, (24, 32, 3)) + (number % 2) * np.array([20, 90, 160])
        Image.fromarray(pixels.astype(np.uint8)).save(tmp_path / path)
        rows.append({"path": path, "class": label, "source": source})
    with (tmp_path / "labels.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, ["path", "class", "source"])
        writer.writeheader()
        writer.writerows(rows)
    priors = {"note": "made up", "rain": [5, 25], "shine": [20, 34]}
    (tmp_path / "weather" / "priors.json").write_text(json.dumps(priors))
    assert climate.main(["--data", str(tmp_path), "--capture", str(tmp_path / "none")]) == 0
    *table, last = capsys.readouterr().out.strip().splitlines()
    report = json.loads(last)
    assert report["training"] == "climate"
    assert report["earned"] is True  # made to be told
    assert any("pooled" in line for line in table)
    assert {"right", "mae_c", "mae_c_default", "classes"} <= set(report["rows"][0])


def test_without_data_the_command_says_so(tmp_path, capsys) -> None:
    assert climate.main(["--data", str(tmp_path)]) == 2
    assert "labels.csv" in capsys.readouterr().out
