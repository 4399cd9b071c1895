"""The chart of skin temperature: the product is exact, and a cheaper method is not."""

from __future__ import annotations

import json

import mpmath
import numpy as np
import pytest
from thermal_reference import Stage, contact_surface, sharp, skin_surface

from hapticvlm.commands.main import main
from hapticvlm.rendering.heat.contact import SKIN, thermal_contact
from hapticvlm_lab.bench import thermal as chart
from hapticvlm_lab.bench.thermal import METHODS, Method, Row

NAMED = {method.name: method for method in METHODS}
GLASS = chart.BULKS["glass"]


def worst_c(method: Method, resistances: tuple[float, ...] = chart.RESISTANCES) -> float:
    """Worst error over four materials, these resistances and two frame rates."""
    return max(
        chart.contact_error(method, thermal_contact(bulk, 22.0, contact_resistance=r), rate_hz)
        for bulk in (chart.BULKS[name] for name in ("wood", "glass", "aluminium", "fabric"))
        for r in resistances
        for rate_hz in (20, 90)
    )


def test_the_quadrature_agrees_with_many_digits():
    times = np.array([1e-3, 0.1, 1.0, 100.0])
    for resistance in (0.0, 1e-5, 5e-4, 1e-2):
        contact = thermal_contact(GLASS, 22.0, contact_resistance=resistance)
        found = contact_surface(contact, times)
        for elapsed_s, skin_c in zip(times, found, strict=True):
            with mpmath.workdps(50):
                x = mpmath.inf
                if resistance:
                    admittance = 1 / SKIN.effusivity + 1 / GLASS.effusivity
                    x = mpmath.sqrt(elapsed_s) * admittance / resistance
                left = mpmath.exp(x * x) * mpmath.erfc(x) if resistance else 0
                settled = GLASS.effusivity / (GLASS.effusivity + SKIN.effusivity)
                exact = float(32 - 10 * settled * (1 - left))
            assert skin_c == pytest.approx(exact, abs=1e-9)


@pytest.mark.nightly
def test_both_yardsticks_agree_on_one_contact():
    contact = thermal_contact(GLASS, 22.0)
    stages = [Stage(0.0, contact)]
    rows = skin_surface(stages, 5.0)
    good = sharp(rows[:, 0], stages)
    off = np.abs(rows[:, 1] - contact_surface(contact, rows[:, 0]))
    assert off[good].max() < 0.03


@pytest.mark.nightly
def test_the_default_is_below_a_tenth_of_a_degree_everywhere():
    (default,) = [method for method in METHODS if method.is_default]
    assert worst_c(default) < 1e-6
    for slide in chart.SLIDES:
        stages = chart.staged(slide)
        assert chart.slide_error(default, stages, chart.truth(stages), 90) < 0.05


@pytest.mark.nightly
def test_methods_without_depth_forget_what_slides_leave():
    stages = chart.staged((("metal", "fabric"), 1.0, None))
    known = chart.truth(stages)
    assert chart.slide_error(NAMED["closed form, forgetful"], stages, known, 90) > 3.0
    assert chart.slide_error(NAMED["closed form"], stages, known, 90) < 0.05


def test_the_contact_temperature_at_once_is_far_off():
    assert worst_c(NAMED["contact temperature"], (5e-4,)) > 5.0


def test_the_default_is_named_as_cheapest_below_the_floor_only_when_it_is():
    def row(method, step_us, contact_c, slide_c, *, is_default=False):
        return Row(method, is_default, contact_c, slide_c, step_us)

    good = row("ours", 3.0, 1e-9, 0.05, is_default=True)
    coarse, forgetful = row("coarse", 1.0, 0.5, 0.05), row("forgetful", 1.0, 1e-9, 4.0)
    assert "ours (the default)" in chart.sentence([good, coarse, forgetful])
    assert "NOT the default" in chart.sentence([good, row("cheaper", 2.0, 0.05, 0.09)])
    assert chart.sentence([forgetful]) == "no method is below the floor"


@pytest.mark.nightly
def test_chart_thermal_writes_a_picture_a_table_and_a_json_line(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(chart, "RATES_HZ", (20,))
    monkeypatch.setattr(chart, "RESISTANCES", (0.0, 5e-4))
    monkeypatch.setattr(chart, "SLIDES", chart.SLIDES[:1])
    monkeypatch.setattr(chart, "ROUNDS", 3)
    assert main(["chart", "thermal", "--out", str(tmp_path)]) == 0

    table = capsys.readouterr().out.strip().splitlines()
    figures = json.loads((tmp_path / "chart-thermal.json").read_text())
    assert any("closed form" in line and "(default)" in line for line in table)
    assert {row["method"] for row in figures["rows"]} == set(NAMED)
    (default,) = [row for row in figures["rows"] if row["is_default"]]
    assert default["contact_c"] < 0.1
    assert default["slide_c"] < 0.1
    assert (tmp_path / "chart-thermal.png").stat().st_size > 10_000
    assert any(line.startswith("wrote ") for line in table)
