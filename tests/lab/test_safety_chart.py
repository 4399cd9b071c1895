"""The safety chart: the compiled core's guards on varied plates."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from hapticvlm.commands.main import main
from hapticvlm_lab.bench.safety import chart
from hapticvlm_lab.bench.safety.chart import Off
from hapticvlm_lab.bench.safety.rig import (
    INJECTIONS,
    STUCK,
    Core,
    CoreError,
    Outcome,
    Phase,
    Rig,
    Setting,
    build,
    draw_plates,
    sum_at,
    try_out,
    try_sound,
)

MISSING = shutil.which("g++") is None
needs_compiler = pytest.mark.skipif(
    MISSING and not os.environ.get("CI"), reason="needs g++ to compile the firmware's core"
)
NOMINAL_MA, FULL_MA = 750, 3000


@pytest.fixture(scope="module")
def core(tmp_path_factory: pytest.TempPathFactory) -> Callable[[int, int], Core]:
    """Cores by window and heat limit, each compiled once."""
    place = tmp_path_factory.mktemp("cores")
    made: dict[Setting, Core] = {}

    def get(window_ms: int, heat_limit_ma: int) -> Core:
        setting = Setting(window_ms, heat_limit_ma)
        if setting not in made:
            made[setting] = build(setting, place)
        return made[setting]

    return get


def test_plates_repeat_for_a_seed_and_scatter_within_their_ranges() -> None:
    plates = draw_plates(200)

    assert plates == draw_plates(200)
    assert plates != draw_plates(200, seed=12)
    assert plates[:20] == draw_plates(20)
    assert min(plate.ambient_c for plate in plates) < 17.0
    assert max(plate.ambient_c for plate in plates) > 30.0
    assert all(1.0 <= plate.sink_k_per_w <= 5.0 for plate in plates)
    assert all(1e-4 <= plate.palm_resistance <= 1e-3 for plate in plates)
    assert len({plate.module for plate in plates}) == 200


def test_a_thermistor_at_25_degrees_reads_half_scale() -> None:
    assert sum_at(25.0) == pytest.approx(8192 - 8)
    assert sum_at(40.0) < sum_at(25.0) < sum_at(10.0)


@pytest.mark.nightly
@needs_compiler
def test_a_sound_plate_follows_its_setpoint_and_nothing_trips(core) -> None:
    plate = draw_plates(1)[0]
    rig = Rig([core(1000, NOMINAL_MA)], plate, seed=3)
    (outcome,) = rig.run([Phase(2.0, 32.0), Phase(8.0, 24.0)])

    assert outcome.faults == ()
    assert outcome.off_after_s is None
    assert rig._plant.plate_c == pytest.approx(24.0, abs=0.6)


@needs_compiler
def test_the_busy_scene_trips_no_sound_plate(core) -> None:
    for plate in draw_plates(5):
        (outcome,) = try_sound([core(1000, NOMINAL_MA)], plate)
        assert outcome.faults == ()
        assert 17.0 < outcome.coldest_c < outcome.peak_c < 42.0


@needs_compiler
@pytest.mark.parametrize("injection", INJECTIONS[:-1], ids=lambda injection: injection.name)
def test_a_fault_switches_off_and_is_named(core, injection) -> None:
    caught = {
        "plate thermistor open": "plate_a_open",
        "plate thermistor short": "plate_b_short",
        "sink thermistor open": "sink_open",
        "sink thermistor short": "sink_short",
        "plate reading jumps": "reading_jumps",
        "one plate thermistor frozen": "plate_disagrees",
        "plate thermistor drifts": "plate_disagrees",
        "module wired backwards": "wired_backwards",
    }
    (outcome,) = try_out([core(1000, NOMINAL_MA)], draw_plates(1)[0], injection)

    assert caught[injection.name] in outcome.faults
    assert outcome.off_after_s is not None
    assert outcome.peak_c < 43.0


@needs_compiler
@pytest.mark.nightly
def test_a_shorter_window_and_a_lower_cap_keep_a_blind_plate_cooler(core) -> None:
    plate = draw_plates(1)[0]
    short, long = try_out([core(500, FULL_MA), core(4000, FULL_MA)], plate, STUCK)
    (capped,) = try_out([core(4000, NOMINAL_MA)], plate, STUCK)

    assert short.faults == long.faults == ("runaway",)
    assert short.peak_c + 5.0 < long.peak_c
    assert capped.peak_c + 5.0 < long.peak_c
    assert long.peak_c > 43.0
    assert short.off_after_s is not None
    assert long.off_after_s is not None
    assert long.off_after_s - short.off_after_s == pytest.approx(3.5, abs=0.15)


@needs_compiler
@pytest.mark.nightly
def test_cores_on_one_plate_do_what_each_does_alone(core) -> None:
    plate = draw_plates(2)[1]
    together = try_out([core(500, FULL_MA), core(4000, FULL_MA)], plate, STUCK)
    alone = [try_out([core(window, FULL_MA)], plate, STUCK)[0] for window in (500, 4000)]

    assert together == alone


def test_a_row_sums_up_what_happened() -> None:
    stuck = [Outcome(peak, 30.0, ("runaway",), 1.0) for peak in (36.0, 38.0, 44.0, 37.0)]
    sound = [Outcome(39.0, 20.0, faults, None) for faults in ((), (), ("runaway",), ())]
    row = chart.row(Setting(), stuck, sound)

    assert row.is_default
    assert (row.window_ms, row.duty_cap) == (1000, 0.25)
    assert (row.peak_median_c, row.peak_worst_c) == (37.5, 44.0)
    assert (row.above_trip, row.false_trips, row.false_by) == (0.25, 0.25, {"runaway": 1})


def test_a_sweep_is_read(tmp_path: Path) -> None:
    path = tmp_path / "sweep.json"
    trials = [
        {
            "faults": ["plate A open"],
            "off_after_s": off_s,
            "cut_out_after_s": None,
            "caught_by": ["firmware"],
            "numbers": ["PLATE_A_OPEN"],
        }
        for off_s in (0.01, None, 0.03)
    ]
    path.write_text("a table\n" + json.dumps({"alone": trials}) + "\n")

    assert chart.read_sweep(path) == [Off("plate A open", 0.03, "firmware, PLATE_A_OPEN")]


@pytest.mark.parametrize(
    "text", ["", "[]", "{}", '{"alone": [{"fault": "x"}]}', '{"alone": 3}', "table"]
)
def test_a_file_that_is_not_a_sweep_is_named(tmp_path: Path, text: str) -> None:
    path = tmp_path / "sweep.json"
    path.write_text(text)

    with pytest.raises(ValueError, match=r"sweep\.json is not the output"):
        chart.read_sweep(path)


def test_a_missing_compiler_is_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))

    with pytest.raises(CoreError, match=r"install g\+\+"):
        build(Setting(), tmp_path)


@needs_compiler
@pytest.mark.nightly
def test_the_chart_prints_a_table_and_the_paths_of_its_files(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    monkeypatch.setattr(chart, "WINDOWS_MS", (1000,))
    monkeypatch.setattr(chart, "HEAT_LIMITS_MA", (NOMINAL_MA,))

    assert main(["chart", "safety", "--plates", "1", "--out", str(tmp_path)]) == 0
    table = capsys.readouterr().out.splitlines()
    told = json.loads((tmp_path / "chart-safety.json").read_text())
    assert told["plates"] == 1
    assert [row["is_default"] for row in told["settings"]] == [True]
    assert len(told["time_to_off"]["faults"]) == len(INJECTIONS)
    assert any("runaway" in line or "both plate thermistors" in line for line in table)
    assert (tmp_path / "chart-safety.png").stat().st_size > 10_000
    written = [f"wrote {tmp_path / f'chart-safety.{kind}'}" for kind in ("png", "svg")]
    assert table[-2:] == written
