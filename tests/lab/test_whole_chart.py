"""Whole pipelines: a scene that states is felt best, nothing worst."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hapticvlm.demo import CAPTURE
from hapticvlm.evidence.ladder import Evidence, decide
from hapticvlm.materials import MATERIALS
from hapticvlm.session.decisions import choose_rendition
from hapticvlm_lab.bench.material.answers import embed
from hapticvlm_lab.bench.material.data import Source, thin
from hapticvlm_lab.bench.material.reading import read_capture, read_kits, scene_of
from hapticvlm_lab.bench.whole import chart, deciding, feeling
from hapticvlm_lab.bench.whole.chart import Row, undominated
from hapticvlm_lab.bench.whole.deciding import STATED as STATED_ALL

STATED = choose_rendition(decide([Evidence("scene", (("metal", 1.0),))]), MATERIALS)
NOTHING = choose_rendition(decide([]), MATERIALS)


@pytest.fixture(scope="module")
def room() -> Source:
    """Two pictures of each object of the demo's capture."""
    return thin(read_capture(CAPTURE), 0, per_object=2)


@pytest.mark.nightly
def test_what_is_stated_is_felt_as_it_is_and_nothing_is_felt_as_nothing() -> None:
    stated = feeling.felt(STATED, "metal")
    nothing = feeling.felt(NOTHING, "metal")
    assert stated.skin_c == pytest.approx(0.0, abs=0.01)
    assert stated.recognised > 0.7
    assert nothing.skin_c > 1.0
    assert nothing.recognised < 0.05


def test_metal_on_plastic_is_no_plastic_and_its_skin_is_too_cold() -> None:
    found = feeling.felt(STATED, "plastic")
    assert found.recognised < 0.1
    assert found.skin_c > 1.0


@pytest.mark.nightly
def test_names_find_some_and_the_eye_beside_them_finds_more(room: Source) -> None:
    def recognised(name: str) -> float:
        way = next(way for way in deciding.ways() if way.name == name)
        found = deciding.decided(way, room, embed(way, room))
        assert len(found) == 11
        felt = [feeling.felt(each.rendition, each.truth) for each in found]
        return sum(each.recognised for each in felt) / len(felt)

    assert recognised("nothing") < recognised("names") < recognised(deciding.ALL)
    assert recognised(deciding.ALL) < recognised(STATED_ALL)


@pytest.mark.nightly
def test_a_scene_that_states_nothing_is_decided_by_the_eye_alone(room: Source) -> None:
    mute = replace(room, stated={})
    fitting = [way for way in deciding.ways() if deciding.fits(way, mute)]
    assert not any(way.rungs or way.refers for way in fitting)
    assert [way.name for way in fitting if deciding.is_default(way, mute)] == ["eye"]


@pytest.mark.nightly
def test_the_table_names_the_default_and_its_interval(
    room: Source, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = chart.measure([(room, "renders")])
    chart.show(rows)
    table = capsys.readouterr().out
    default = next(row for row in rows if row.is_default)
    assert default.low < default.share < default.high
    costs_ms = {row.decides: row.look_ms for row in rows}
    assert costs_ms["nothing"] == costs_ms[STATED_ALL] == 0.0
    assert 0.0 < costs_ms["names"] < costs_ms["eye"]
    line = next(line for line in table.splitlines() if "(default)" in line)
    assert f"{default.share:.0%} [" in line
    assert f"all {default.share:.0%} in {default.look_ms:.1f} ms" in table


def test_kits_are_scenes_whose_names_show_what_the_unnamed_are_made_of(tmp_path: Path) -> None:
    # Four named and one unnamed object of one kit: two colours, so that an eye tells them apart.
    crops = np.zeros((5, 64, 64, 4), np.uint8)
    crops[..., 3] = 255
    crops[:2, ..., :3] = (120, 70, 30)
    crops[2:4, ..., :3] = (150, 155, 160)
    crops[4, ..., :3] = (118, 72, 31)
    names = ("oak_crate", "oak_plank", "steel_beam", "steel_pipe", "thing")
    labels = ["wood", "wood", "metal", "metal", "wood"]
    np.savez(
        tmp_path / "kit.npz", big=crops, label=labels, path=[f"kits/kit/{name}" for name in names]
    )
    source = read_kits(tmp_path)
    assert {scene_of(view.object_id) for view in source.views} == {"kits/kit"}
    ways = {way.name: way for way in deciding.ways()}
    assert not deciding.fits(ways["names, shaders"], source)

    def felt(name: str) -> str | None:
        decisions = deciding.decided(ways[name], source, embed(ways[name], source))
        return next(each for each in decisions if each.object_id.endswith("thing")).rendition.felt

    assert felt("eye") != "wood"
    assert felt("eye, references") == "wood"


def test_only_what_no_cheaper_one_reaches_is_worth_its_cost() -> None:
    dear, good, cheap, beaten = (
        _row(name, share, ms)
        for name, share, ms in (("a", 0.8, 9.0), ("b", 0.7, 5.0), ("c", 0.1, 1.0), ("d", 0.6, 6.0))
    )
    assert undominated([dear, beaten, cheap, good]) == [cheap, good, dear]


def _row(name: str, share: float, ms: float) -> Row:
    return Row("s", "renders", name, False, 9, share, 0.0, 1.0, 0.0, ms)
