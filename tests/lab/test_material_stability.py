"""Stability: severity 0 is the clean picture, a change is what it says, breaks are found."""

import json
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from each_case import each
from tiny_capture import SIDE, drawn, write_capture

from hapticvlm.vision.galleries.storage import load_gallery
from hapticvlm.vision.loading import load_encoder
from hapticvlm.vision.pictures import crop
from hapticvlm_lab.bench.material import stability
from hapticvlm_lab.bench.material.data import FOUR, Source, Where
from hapticvlm_lab.bench.material.perturb import SHAKES, Shake, apply, darken
from hapticvlm_lab.bench.material.picture import (
    OBJECT_PX,
    Picture,
    as_frame,
    length_of,
    linear,
    window,
)
from hapticvlm_lab.bench.material.reading import read_capture
from hapticvlm_lab.bench.material.stability import (
    Curve,
    Default,
    Step,
    predict_clean,
    sentence,
    shaken,
)

IDS = [shake.name for shake in SHAKES]
BY_NAME = {shake.name: shake for shake in SHAKES}
OF_LIGHT = ("blur", "noise", "dark", "bright", "JPEG", "stylised", "night")


@pytest.fixture(scope="module")
def source(tmp_path_factory: pytest.TempPathFactory) -> Source:
    return read_capture(write_capture(tmp_path_factory.mktemp("shaken") / "tiny")).keep(FOUR)


@pytest.fixture(scope="module")
def default() -> Default:
    encoder = load_encoder()
    return Default(encoder, load_gallery(encoder=encoder))


def picture(truth: str = "wood") -> Picture:
    return Picture(*drawn(truth, 1, 1), drawn("fabric", 2, 0)[0])


def at_worst(shake: Shake, shown: Picture, seed: int = 3) -> Picture:
    return apply(shake, shown, shake.severities[-1], seed)


def same(one: Picture, other: Picture) -> bool:
    return np.array_equal(one.image, other.image) and np.array_equal(one.mask, other.mask)  # type: ignore[arg-type]


@each(shake=SHAKES)
def test_severity_0_changes_nothing_and_comes_first(shake: Shake) -> None:
    shown = picture()
    assert shake.severities[0] == 0
    assert list(shake.severities) == sorted(shake.severities)
    assert same(apply(shake, shown, 0.0, 3), shown)


@each(shake=SHAKES)
def test_a_change_is_repeatable_whole_and_leaves_its_argument_alone(shake: Shake) -> None:
    shown, before = picture(), picture()
    once, again = at_worst(shake, shown), at_worst(shake, shown)
    assert same(once, again)
    assert same(shown, before)
    assert not same(once, shown)
    assert once.image.dtype == np.uint8
    assert once.mask is not None
    assert set(np.unique(once.mask)) <= {0, 255}
    assert once.mask.any()


SAME_SIZE = [shake for shake in SHAKES if shake.name != "size"]


@each(shake=SAME_SIZE)
def test_worse_is_farther_from_the_clean_picture(shake: Shake) -> None:
    shown = picture()
    planes = [apply(shake, shown, severity, 3) for severity in shake.severities]
    away = [_distance(one, shown) for one in planes]
    assert all(one <= other * 1.05 for one, other in pairwise(away)), away


@each(name=OF_LIGHT)
def test_light_changes_no_mask_and_no_size(name: str) -> None:
    shown = picture()
    changed = at_worst(BY_NAME[name], shown)
    assert changed.image.shape == shown.image.shape
    assert np.array_equal(changed.mask, shown.mask)  # type: ignore[arg-type]


def test_a_stop_under_halves_the_light() -> None:
    shown = Picture(np.full((8, 8, 3), 200, np.uint8), None)
    darker = darken(shown, 1.0, np.random.default_rng(0))
    ratio = linear(darker.image).mean() / linear(shown.image).mean()
    assert ratio == pytest.approx(0.5, abs=0.01)


def test_a_halving_halves_picture_and_mask() -> None:
    shown = picture()
    small = apply(BY_NAME["size"], shown, 1.0, 3)
    assert small.image.shape == (SIDE // 2, SIDE // 2, 3)
    assert shown.mask is not None
    assert small.mask is not None
    assert length_of(small.mask) == pytest.approx(length_of(shown.mask) / 2, abs=1)
    tiny = apply(BY_NAME["size"], shown, 6.0, 3)
    assert tiny.mask is not None
    assert tiny.mask.any()


@pytest.mark.parametrize("share", [0.2, 0.6])
def test_an_occluder_covers_the_share_it_says(share: float) -> None:
    shown = picture()
    covered = apply(BY_NAME["occlusion"], shown, share, 3)
    assert shown.mask is not None
    inside = shown.mask > 0
    changed = (covered.image != shown.image).any(axis=2)[inside].mean()
    assert changed == pytest.approx(share, abs=0.03)


@pytest.mark.parametrize("name", ["clutter", "reflections"])
def test_what_shows_in_the_object_leaves_its_surroundings_alone(name: str) -> None:
    shown = picture("glass")
    changed = at_worst(BY_NAME[name], shown)
    assert shown.mask is not None
    outside = shown.mask == 0
    assert np.array_equal(changed.image[outside], shown.image[outside])


def test_mirrors_round_an_object_leave_the_object_alone() -> None:
    shown = picture()
    changed = at_worst(BY_NAME["mirrors"], shown)
    assert shown.mask is not None
    inside = shown.mask > 0
    assert np.array_equal(changed.image[inside], shown.image[inside])


def test_a_window_shows_the_object_and_its_surroundings(source: Source) -> None:
    view = source.views[0]
    shown = window(view)
    assert shown.mask is not None
    assert length_of(shown.mask) <= OBJECT_PX
    assert (shown.mask == 0).any()
    whole, cut = crop(view.as_cut("mask"), 64), crop(as_frame(shown), 64)
    assert np.abs(whole.image.astype(int) - cut.image.astype(int)).mean() < 4
    assert (whole.mask != cut.mask).mean() < 0.03


@pytest.mark.nightly
def test_the_clean_step_is_the_clean_answer(source: Source, default: Default) -> None:
    clean = predict_clean(source, default)
    curves = [shaken(clean, BY_NAME[name], default) for name in ("blur", "clutter")]
    assert curves[0].n == len(source.views)
    assert curves[1].n == (source.truth == "glass").sum()
    for curve in curves:
        first = curve.steps[0]
        assert (first.severity, first.flips) == (0, 0.0)
    right = clean.predictions.forced == clean.truth
    shares = [right[clean.truth == name].mean() for name in FOUR]
    assert curves[0].steps[0].accuracy == pytest.approx(np.mean(shares))


@pytest.mark.nightly
def test_unchanged_pictures_flip_nothing_whatever_the_severity(
    source: Source, default: Default
) -> None:
    clean = predict_clean(source, default)
    idle = Shake("idle", lambda shown, _severity, _rng: shown, (0, 1, 2), "nothing")
    steps = shaken(clean, idle, default).steps
    assert {step.flips for step in steps} == {0.0}
    assert len({step.accuracy for step in steps}) == 1


def test_a_break_is_where_half_of_the_lead_is_lost() -> None:
    curve = Curve("blur", "px", 10, tuple(map(_step, (0, 1, 2), (0.85, 0.85, 0.25))))
    assert curve.breaks_at() == pytest.approx(1.5)
    assert "loses half its lead at 1.5" in sentence(curve)
    kept = Curve("blur", "px", 10, tuple(map(_step, (0, 1), (0.85, 0.6))))
    assert kept.breaks_at() is None
    assert "keeps half its lead to 1" in sentence(kept)
    none = Curve("blur", "px", 10, tuple(map(_step, (0, 1), (0.25, 0.1))))
    assert none.breaks_at() is None
    assert "no lead to lose" in sentence(none)


@pytest.mark.nightly
def test_curves_are_drawn_and_their_figures_given(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    capture = write_capture(tmp_path / "tiny")
    assert stability.run(Where(None, 4, capture), tmp_path, as_json=True) == 0
    figures = json.loads(capsys.readouterr().out.splitlines()[-1])
    found = figures["sources"]["tiny"]
    assert [curve["name"] for curve in found] == IDS
    assert all(curve["steps"][0]["flips"] == 0 for curve in found)
    for file in figures["files"]:
        assert Path(file).stat().st_size > 5000


def _step(severity: float, accuracy: float) -> Step:
    return Step(severity, accuracy, 0.0, 1.0, 0.0, 0.0)


def _distance(one: Picture, other: Picture) -> float:
    assert one.mask is not None
    assert other.mask is not None
    pixels = np.abs(one.image.astype(float) - other.image.astype(float)).mean()
    return float(pixels + 255 * (one.mask != other.mask).mean())
