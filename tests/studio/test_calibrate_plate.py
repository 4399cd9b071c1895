"""The plate resistance of a palm is found from the heat it takes, whatever the module is like."""

from __future__ import annotations

import argparse
import json
import math

import layered_palm
import numpy as np
import pytest
from plate_ports import Cable
from unknown_plate import UnknownPlate

from hapticvlm.commands import serve
from hapticvlm.commands.main import main
from hapticvlm.devices.errors import DeviceError
from hapticvlm.devices.plate.protocol import Setpoint, State
from hapticvlm.devices.simulated.simulated import SimulatedPlate
from hapticvlm.devices.simulated.simulated_board import SimulatedBoard
from hapticvlm.rendering.heat.limits import COOL_SLEW_C_PER_S
from hapticvlm.server.options import plate_resistance
from hapticvlm_studio.calibration.plate_flow import (
    RUN_S,
    SETTLE_S,
    Floats,
    PalmError,
    bead_lag_s,
    estimate,
    middle_c,
)
from hapticvlm_studio.calibration.plate_trajectory import NextTick, simulated_time, swing

RESISTANCES = (2e-4, 5e-4, 1e-3)
OVERHEAD_S = 3e-4  # of a turn of the host, whose ticks are never the board's


class Bench:
    """A plate of which only the type is known, at the end of a line, and palms for it."""

    def __init__(self, seed: int) -> None:
        self.unknown = UnknownPlate(seed)
        self.cable = Cable(lambda: SimulatedBoard(self.unknown))
        self.plate = self.cable.plate()
        self.around_c = middle_c(self.plate.advance(self.turn()).sink_c)

    def turn(self) -> float:
        self.plate.poll()
        self.cable.clock.wait(OVERHEAD_S)
        return self.cable.clock.now

    def swing(self) -> Floats:
        return swing(self.plate, self.around_c, self.turn)

    def swing_with(self, resistance: float) -> Floats:
        self.unknown.lay(resistance)
        return self.swing()


@pytest.mark.nightly
@pytest.mark.parametrize("seed", [0, 1, 2])
@pytest.mark.slow
def test_palms_on_a_module_that_nobody_measured_are_found_within_35_percent(seed):
    bench = Bench(seed)
    bare = bench.swing()
    found = [estimate(bare, bench.swing_with(planted)) for planted in RESISTANCES]

    shares = np.array([palm.plate_resistance for palm in found]) / RESISTANCES
    print(shares.round(2))
    assert shares == pytest.approx(np.ones(3), rel=0.35)
    assert all(
        palm.low < planted < palm.high for palm, planted in zip(found, RESISTANCES, strict=True)
    )


@pytest.mark.parametrize(
    ("thickness_m", "conductivity", "within"),
    [(6e-4, 0.24, 0.3), (3e-4, 0.24, 0.2), (6e-4, 0.20, 0.3), (8e-4, 0.20, 0.4)],
)
@pytest.mark.slow
@pytest.mark.nightly
def test_a_palm_with_a_horny_layer_is_found_and_its_interval_holds(
    thickness_m, conductivity, within
):
    shares, held = [], []
    for seed in range(10):
        gain = math.exp(0.15 * np.random.default_rng(seed).normal())
        bare = layered_palm.run(None, seed)
        for planted in (*RESISTANCES, 2e-3):
            palm = layered_palm.admittance(planted, thickness_m, conductivity, gain)
            found = estimate(bare, layered_palm.run(palm, seed + 100))
            shares.append(found.plate_resistance / planted)
            held.append(found.low < planted < found.high)
    print(np.median(shares).round(2), min(shares), max(shares))
    assert np.mean(held) >= 0.9
    assert 1.0 - within < min(shares)
    assert max(shares) < 1.0 + within
    assert np.median(shares) == pytest.approx(1.0, abs=0.15)


@pytest.fixture(scope="module")
def simulated() -> tuple[SimulatedPlate, NextTick, Floats]:
    """A plate that has swung bare."""
    plate, turn = SimulatedPlate(palm_resistance=math.inf), simulated_time()
    return plate, turn, swing(plate, 28.0, turn)


@pytest.mark.parametrize("lag_s", [0.0, 0.3, 1.0])
def test_the_bare_swing_finds_the_lag_of_the_thermistor(lag_s):
    plate = SimulatedPlate(palm_resistance=math.inf, bead_lag_s=lag_s)
    plate.lag_s = 0.3  # as on a board that was never told

    assert bead_lag_s(swing(plate, 28.0, simulated_time())) == pytest.approx(lag_s, abs=0.05)


def test_a_board_keeps_the_lag_once_its_plate_is_off():
    bench = Bench(0)
    bench.unknown.lag_s = 0.3
    bench.plate.command(28.0, 0.25, bench.turn())
    for _ in range(5):
        bench.turn()
    bench.plate.rest(bench.turn())

    bench.plate.keep_lag(0.65)

    assert bench.unknown.lag_s == 0.65
    with pytest.raises(DeviceError, match="range"):
        bench.plate.keep_lag(1.2)


def test_a_plate_that_nobody_touched_says_that_no_palm_was_there(simulated):
    plate, turn, bare = simulated

    with pytest.raises(PalmError, match="let the whole palm rest on the plate"):
        estimate(bare, swing(plate, 28.0, turn))


def test_a_palm_that_lay_there_in_both_runs_or_only_in_the_first_is_refused(simulated):
    plate, turn, bare = simulated
    plate.touch(5e-4)
    palm = swing(plate, 28.0, turn)
    plate.touch(math.inf)

    for first, second in ((palm, palm), (palm, bare)):
        with pytest.raises(PalmError, match="touch nothing in the first run"):
            estimate(first, second)


def test_a_palm_that_was_lifted_on_the_way_did_not_rest_still(simulated):
    plate, turn, bare = simulated
    plate.touch(5e-4)
    laid = swing(plate, 28.0, turn)
    lifted = np.vstack((laid[laid[:, 0] < RUN_S / 2], bare[bare[:, 0] >= RUN_S / 2]))
    plate.touch(math.inf)

    with pytest.raises(PalmError, match="did not rest still"):
        estimate(bare, lifted)


def test_a_plate_that_does_not_move_says_so(simulated):
    _, _, bare = simulated
    still = bare.copy()
    still[:, 1] = 28.0

    with pytest.raises(PalmError, match="did not swing"):
        estimate(still, bare)


def test_the_swing_stays_cool_and_within_the_slew_limit():
    bench = Bench(0)
    run = bench.swing()

    steps = [one.setpoint_mc for one in bench.cable.sent if isinstance(one, Setpoint)]
    assert 18_000 <= min(steps) <= max(steps) <= 32_000
    assert np.abs(np.diff(steps)).max() <= 1000 * COOL_SLEW_C_PER_S * 0.1
    assert np.ptp(run[run[:, 0] > SETTLE_S][:, 1]) > 1.5
    bench.turn()
    assert bench.unknown.state is State.RETURNING


def test_a_fault_ends_the_run_in_its_own_words_and_opens_the_bridge():
    bench = Bench(0)
    bench.unknown._faults = ("sink_hot",)

    with pytest.raises(DeviceError, match="sink_hot"):
        bench.swing()
    assert bench.unknown.current_a == 0.0


def test_whoever_interrupts_a_run_leaves_the_plate_on_its_way_to_off():
    plate, ticks = SimulatedPlate(), simulated_time()

    def turn() -> float:
        now = ticks()
        if now > 2.0:
            raise KeyboardInterrupt
        return now

    with pytest.raises(KeyboardInterrupt):
        swing(plate, 28.0, turn)
    states = [plate.state]
    for now in (6.0, 10.0):
        plate.advance(now)
        states.append(plate.state)
    assert (states[0], states[-1]) == (State.RETURNING, State.OFF)


@pytest.mark.parametrize(
    ("sink_c", "around_c"), [(None, 30.0), (10.0, 22.0), (23.0, 27.0), (40.0, 30.0)]
)
def test_the_middle_of_the_swing_is_in_reach_of_the_current(sink_c, around_c):
    assert middle_c(sink_c) == around_c


def test_what_the_command_writes_is_taken_as_plate_resistance(tmp_path, capsys):
    kept = tmp_path / "plate.json"
    assert main(["calibrate", "plate", "--simulate", "5e-4", "--out", str(kept)]) == 0
    assert f"--plate-resistance {kept}" in capsys.readouterr().out

    told = json.loads(kept.read_text())
    assert told["simulated"] is True
    assert told["low"] < 5e-4 < told["high"]
    assert plate_resistance(str(kept)) == told["plate_resistance"]

    parser = argparse.ArgumentParser()
    serve.add_flags(parser)
    serving = serve.resolve_options(parser.parse_args(["--plate-resistance", str(kept)]), {})
    assert serving.plate_resistance == told["plate_resistance"]


@pytest.mark.nightly
def test_a_result_that_cannot_be_written_is_told_all_the_same(tmp_path, capsys):
    nowhere = tmp_path / "nowhere" / "plate.json"

    assert main(["calibrate", "plate", "--simulate", "5e-4", "--out", str(nowhere)]) == 2
    said = capsys.readouterr()
    assert "plate resistance 0.000" in said.out
    assert str(nowhere) in said.err
