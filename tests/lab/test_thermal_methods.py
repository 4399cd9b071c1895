"""Ways to follow the skin, side by side: which err how far, and where each breaks."""

from __future__ import annotations

import contextlib
import io
import json
import math
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
import pytest

from hapticvlm.commands.main import main
from hapticvlm.rendering.heat.contact import SKIN, thermal_contact
from hapticvlm_lab.bench.thermal import breaks, chart, grids, plate_term, timing
from hapticvlm_lab.bench.thermal.breaks import ALUMINIUM, FRAME_S
from hapticvlm_lab.bench.thermal.loop import wind_up
from hapticvlm_lab.bench.thermal.methods import METHODS, Closed, Method, Row, fitted, uniform_cells
from hapticvlm_lab.bench.thermal.reference import Stage, contact_surface, sharp, skin_surface

NAMED = {method.name: method for method in METHODS}
GLASS, SOFTWOOD = breaks.BULKS["glass"], breaks.BULKS["softwood"]


def worst_c(method: Method, resistances: tuple[float, ...] = chart.RESISTANCES) -> float:
    """Worst error over four materials, these resistances and two frame rates."""
    return max(
        chart.contact_error(method, thermal_contact(bulk, 22.0, contact_resistance=r), rate_hz)
        for bulk in (*breaks.BULKS.values(), chart.BULKS["fabric"])
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


def test_both_yardsticks_agree_on_one_contact():
    contact = thermal_contact(GLASS, 22.0)
    stages = [Stage(0.0, contact)]
    rows = skin_surface(stages, 5.0)
    good = sharp(rows[:, 0], stages)
    off = np.abs(rows[:, 1] - contact_surface(contact, rows[:, 0]))
    assert off[good].max() < 0.03


def test_the_default_is_below_a_tenth_of_a_degree_everywhere():
    (default,) = [method for method in METHODS if method.is_default]
    assert worst_c(default) < 1e-6
    for slide in chart.SLIDES:
        stages = chart._stages(slide)
        assert chart.slide_error(default, stages, chart.truth(stages), 90) < 0.05


def test_more_exponentials_and_more_cells_err_less():
    for names in (
        ("contact temperature", "1 exponential", "2 exponentials", "3 exponentials"),
        ("4 graded cells, exact step", "8 graded cells, exact step", "20 graded cells, exact step"),
    ):
        errors = [worst_c(NAMED[name], (1e-4, 5e-4)) for name in names]
        assert errors == sorted(errors, reverse=True)
        assert errors[-1] < 0.1
    assert worst_c(NAMED["contact temperature"], (5e-4,)) > 5.0


def test_fits_on_log_spaced_times_reproduce_the_reference_table():
    # docs/physics.md 1.4: 3 exponentials miss aluminium at 5e-4 m2 K/W by 0.047 degC after 0.1 s.
    contact = thermal_contact(ALUMINIUM, 23.0, contact_resistance=5e-4, skin_c=33.0)
    end, heights, rates = fitted(contact, 3)
    times = np.geomspace(0.1, 10.0, 200)
    found = 33.0 - 10.0 * (end + np.exp(-times[:, None] * rates) @ heights)
    assert np.abs(found - contact_surface(contact, times)).max() < 0.1


def test_methods_without_depth_forget_what_slides_leave():
    stages = chart._stages((("metal", "fabric"), 1.0, None))
    known = chart.truth(stages)
    assert chart.slide_error(NAMED["closed form, forgetful"], stages, known, 90) > 3.0
    assert chart.slide_error(NAMED["20 graded cells, exact step"], stages, known, 90) < 0.1


def test_a_trace_per_contact_misses_the_mark_that_the_default_keeps():
    stages = chart._stages((("metal", "aluminium"), 1.0, None))
    known = chart.truth(stages)
    missed, kept = (
        chart.slide_error(NAMED[name], stages, known, 90)
        for name in ("closed form, a trace per contact", "closed form")
    )
    assert kept < 0.05 < 0.1 < missed < 0.2


@pytest.mark.parametrize(
    ("bulk", "limit_ms"),
    [(SKIN, 51.0), (SOFTWOOD, 29.0), (GLASS, 10.5), (ALUMINIUM, 0.072)],
)
def test_the_explicit_limits_are_those_of_the_reference(bulk, limit_ms):
    assert grids.explicit_limit_s(bulk, 1e-4) * 1e3 == pytest.approx(limit_ms, rel=0.02)


def test_explicit_euler_at_90_hz_holds_on_wood_creeps_off_on_glass_explodes_on_aluminium():
    errors = {
        name: breaks.euler_errors(thermal_contact(bulk, 22.0, contact_resistance=5e-4), FRAME_S)
        for name, bulk in breaks.BULKS.items()
    }
    assert errors["softwood"][90:].max() < 0.01
    assert errors["glass"][-1] > 1000.0
    lost = breaks.first_lost(errors["aluminium"])
    assert lost is not None
    assert lost <= 6


def test_explicit_euler_explodes_on_aluminium_even_at_a_millisecond():
    contact = thermal_contact(ALUMINIUM, 22.0, contact_resistance=5e-4)
    lost = breaks.first_lost(breaks.euler_errors(contact, 1e-3))
    assert lost is not None
    assert lost <= 10


def test_crank_nicolson_rings_where_backward_euler_and_the_default_do_not():
    contact = thermal_contact(ALUMINIUM, 22.0, contact_resistance=breaks.STIFF)

    def turns(skin):
        return breaks.turns(breaks.follow(skin, contact, FRAME_S, 2.0))

    assert turns(uniform_cells(grids.crank_nicolson)(FRAME_S)) > 50
    assert turns(uniform_cells(grids.backward_euler)(FRAME_S)) <= breaks.MOST_TURNS
    assert turns(Closed(FRAME_S)) == 0


@pytest.mark.parametrize(("kind", "end"), [(np.float32, 9.4), (np.float64, 26.6)])
def test_exp_times_erfc_overflows_where_the_reference_says(kind, end):
    assert breaks.overflow_at(kind) == pytest.approx(end, abs=0.15)


def test_windup_overshoots_and_a_waiting_integral_does_not():
    wound, guarded = wind_up(guarded=False), wind_up(guarded=True)
    assert wound.overshoot_c > 3.0
    assert guarded.overshoot_c < 0.5
    assert guarded.settled_s is not None
    assert wound.settled_s is None or wound.settled_s > guarded.settled_s


@pytest.fixture(scope="module")
def stability_figures(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """What `stability thermal` prints as JSON: every trial takes ten seconds of a processor."""
    out = tmp_path_factory.mktemp("stability")
    with contextlib.redirect_stdout(io.StringIO()) as printed:
        assert main(["stability", "thermal", "--out", str(out), "--json"]) == 0
    figures: dict[str, Any] = json.loads(printed.getvalue())
    return figures


def test_every_trial_of_the_product_holds(stability_figures):
    trials = [trial for group in stability_figures["groups"] for trial in group["trials"]]
    ours = [trial for trial in trials if "default" in trial["what"] or "closed" in trial["what"]]
    assert len(ours) >= 15
    assert [trial for trial in ours if trial["breaks"]] == []
    assert len([trial for trial in trials if trial["breaks"]]) >= 10


def test_the_default_is_named_as_cheapest_below_the_floor_only_when_it_is():
    def row(method, touch_us, felt_c, slide_c, *, is_default=False):
        return Row(
            method, "closed", is_default, felt_c, "", slide_c, "", touch_us, 0.0, touch_us, 1.0
        )

    good = row("ours", 3.0, 1e-9, 0.05, is_default=True)
    coarse, lost = row("coarse", 1.0, 0.5, 0.05), row("lost", 0.5, None, None)
    forgetful = row("forgetful", 1.0, 1e-9, 4.0)
    assert "ours (the default)" in chart.sentence([good, coarse, forgetful, lost])
    assert "NOT the default" in chart.sentence([good, row("cheaper", 2.0, 0.05, 0.09)])
    assert chart.sentence([lost]) == "no method is below the floor"


def test_chart_thermal_writes_a_picture_a_table_and_a_json_line(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(chart, "RATES_HZ", (20,))
    monkeypatch.setattr(chart, "RESISTANCES", (0.0, 5e-4))
    monkeypatch.setattr(chart, "SLIDES", chart.SLIDES[:1])
    monkeypatch.setattr(timing, "ROUNDS", 3)
    monkeypatch.setattr(timing, "STEPS", 20)
    monkeypatch.setattr(plate_term, "ROUNDS", 1)
    monkeypatch.setattr(plate_term, "ROOMS_C", (22.0,))
    monkeypatch.setattr(plate_term, "PALMS", (1e-3,))
    monkeypatch.setattr(plate_term, "TOUCHED", ("glass", "metal"))
    assert main(["chart", "thermal", "--out", str(tmp_path)]) == 0

    table = capsys.readouterr().out.strip().splitlines()
    figures = json.loads((tmp_path / "chart-thermal.json").read_text())
    assert any("closed form" in line and "(default)" in line for line in table)
    assert {row["method"] for row in figures["rows"]} == set(NAMED)
    (default,) = [row for row in figures["rows"] if row["is_default"]]
    assert default["felt_c"] < 0.1
    assert default["slide_c"] < 0.1
    terms = {row["method"]: row for row in figures["plate_terms"]}
    (known,) = [row for row in terms.values() if row["is_default"]]
    assert max(known["contact_c"], known["slide_c"]) < 0.05
    assert terms["without the term"]["contact_c"] > 1.0
    assert terms["closed form, first contact only"]["slide_c"] > plate_term.MARK_C
    assert (tmp_path / "chart-thermal-plate.png").stat().st_size > 5_000
    assert (tmp_path / "chart-thermal.png").stat().st_size > 10_000
    assert any(line.startswith("wrote ") for line in table)


def test_stability_thermal_writes_a_picture_and_a_json_line(stability_figures):
    verdicts = [t["breaks"] for group in stability_figures["groups"] for t in group["trials"]]
    assert any(verdicts)
    assert not all(verdicts)
    (picture,) = (path for path in map(Path, stability_figures["files"]) if path.suffix == ".png")
    assert picture.name == "stability-thermal.png"
    assert picture.stat().st_size > 10_000


def test_a_method_that_gives_no_number_is_said_to_overflow():
    assert math.isinf(worst_c(NAMED["explicit Euler, 0.1 mm"], (5e-4,)))
    assert chart._degrees(None) == "overflow"
