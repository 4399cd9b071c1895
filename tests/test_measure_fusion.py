"""`hapticvlm measure fusion`: its figures on looks whose outcome is known, and the real command."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from hapticvlm.measure.fusion import Felt, feel, figures, first, switches
from hapticvlm.measure.streams import Stream, read_streams
from hapticvlm.measure.ways import ways
from hapticvlm.recognition.encoder import load_encoder
from hapticvlm.recognition.gallery import Gallery, load_gallery
from hapticvlm.recognition.ladder import Evidence

LIVING_ROOM = Path(__file__).parents[1] / "examples" / "captures" / "living_room"


@pytest.fixture(scope="module")
def gallery() -> Gallery:
    return load_gallery(encoder=load_encoder())


def stream(truth: str, seen: str, *, unchanged: int = 0) -> Stream:
    """One look a letter: w(ood), m(etal), ? for nothing; then frames whose picture is the same."""
    says = {
        "w": Evidence("encoder", (("wood", 0.9),)),
        "m": Evidence("encoder", (("metal", 0.9),)),
        "?": Evidence("encoder", ()),
    }
    count = len(seen) + unchanged
    evidence = np.empty(count, np.object_)
    evidence[:] = [says[letter] for letter in seen] + [says["?"]] * unchanged
    rng = np.random.default_rng(1)
    embeddings = rng.normal(size=(count, 128)).astype(np.float32)
    return Stream(
        np.array([truth] * count, np.object_),
        evidence,
        embeddings / np.linalg.norm(embeddings, axis=1, keepdims=True),
        np.ones(count, np.float32),
        np.ones(count, np.float32),
        np.array([True] * len(seen) + [False] * unchanged),
    )


def test_flips_swaps_and_returns_are_told_apart(gallery: Gallery) -> None:
    felt = Felt(
        np.array(["wood"] * 6, np.object_),
        np.array(["unknown", "wood", "metal", "wood", "wood", "metal"], np.object_),
        np.array(["wood"] * 6, np.object_),
        np.zeros(6),
    )
    assert len(felt.flips) == 4
    assert felt.returns == 2
    row = figures(ways()["latest look"], [stream("wood", "?wmwwm")], gallery)
    assert row["flips_per_300"] == pytest.approx(4 * 300 / 5)
    assert row["swaps_per_300"] == pytest.approx(3 * 300 / 5)
    assert row["returns_per_300"] == pytest.approx(2 * 300 / 5)
    assert (row["right"], row["wrong"], row["frames_until_right"]) == (0.5, 0.333, 2.0)


def test_an_unchanged_picture_is_not_looked_at_and_its_label_stays(gallery: Gallery) -> None:
    felt = feel(ways()["latest look"], stream("wood", "?w", unchanged=3), gallery)
    assert felt.said.tolist() == ["unknown", "wood", "wood", "wood", "wood"]


def test_a_switch_counts_looks_until_the_old_is_gone_and_the_new_is_said(gallery: Gallery) -> None:
    streams = [stream("wood", "w" * 30), stream("metal", "m" * 30)]
    shipped = switches(ways()["shipped"], streams, gallery)
    latest = switches(ways()["latest look"], streams, gallery)
    slow = switches(ways()["moving average, 1/32"], streams, gallery)
    assert (latest["looks_until_old_gone"], latest["looks_until_new_said"]) == (1.0, 1.0)
    assert shipped["looks_until_new_said"] == 4.0
    assert slow["looks_until_new_said"] is not None
    assert float(str(slow["looks_until_new_said"])) > 10


def test_an_object_of_no_class_is_right_when_it_stays_unknown(gallery: Gallery) -> None:
    row = figures(ways()["shipped"], [stream("unknown", "????")], gallery)
    assert (row["right"], row["never_right"]) == (1.0, 0)


@pytest.mark.parametrize("name", list(ways()))
def test_every_way_gives_a_belief_after_every_look(gallery: Gallery, name: str) -> None:
    one = stream("wood", "wwm?wmwww")
    fused = ways()[name](one, gallery)
    assert len(fused) == 9
    for evidence in fused:
        beliefs = [belief for _, belief in evidence.beliefs]
        assert all(0.0 <= belief <= 1.0 for belief in beliefs)
        assert sum(beliefs) <= 1.0 + 1e-9
    if "embedding" not in name:
        assert fused[-1].material == "wood"


def test_the_first_hit_is_counted_from_one() -> None:
    assert first(np.array([False, True, True])) == 2
    assert first(np.array([False])) is None


def test_a_capture_is_one_stream_an_object(gallery: Gallery) -> None:
    streams = read_streams(LIVING_ROOM, load_encoder(), gallery)
    assert len(streams) == 16
    for one in streams:
        assert len(set(one.truth.tolist())) == 1
        assert one.is_new[0]
        assert (one.size > 5).all()
        assert (one.size <= 448).all()
        assert (one.sharpness >= 0).all()


def command(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    line = [sys.executable, "-m", "hapticvlm", "measure", "fusion", *map(str, arguments)]
    return subprocess.run(line, capture_output=True, text=True, check=False, timeout=120)


def test_the_command_ends_with_a_line_of_json() -> None:
    done = command("--capture", LIVING_ROOM)
    assert done.returncode == 0
    result = json.loads(done.stdout.splitlines()[-1])
    assert (result["measure"], result["objects"]) == ("fusion", 16)
    assert result["looks"] <= result["frames"]
    assert [row["way"] for row in result["rows"]] == list(ways())


def test_a_capture_that_is_not_there_is_said_in_a_line() -> None:
    done = command("--capture", "nowhere")
    assert done.returncode == 2
    assert len(done.stderr.strip().splitlines()) == 1
