"""Tests the plant against docs/physics.md, and the simulated plate's control and guards."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable

import pytest
from each_case import each

from hapticvlm.devices.plate.plate import Plate
from hapticvlm.devices.simulated.plant import (
    FACE_J_PER_K,
    RESISTANCE,
    SEEBECK,
    SINK_J_PER_K,
    SINK_K_PER_W,
    Plant,
)
from hapticvlm.devices.simulated.simulated import SimulatedPlate
from hapticvlm.perception import NEUTRAL_C
from hapticvlm.rendering.heat.limits import PlateReading

REST_S = 900.0
COOL_SLEW_C_PER_S = 12.0

TICK_S = 0.02


def hold(
    plate: Plate, setpoint_c: float, seconds: float, begin_s: float = 0.0
) -> list[PlateReading]:
    """Command and advance at 50 Hz, as the gateway does; return every reading."""
    readings = []
    for tick in range(round(seconds / TICK_S)):
        now = begin_s + tick * TICK_S
        plate.command(setpoint_c, 0.25, now)
        readings.append(plate.advance(now + TICK_S))
    return readings


def leave(plate: Plate, seconds: float, begin_s: float) -> list[PlateReading]:
    """Advance at 50 Hz without a command; return every reading."""
    return [
        plate.advance(begin_s + tick * TICK_S) for tick in range(1, round(seconds / TICK_S) + 1)
    ]


def plate_c(reading: PlateReading) -> float:
    assert reading.plate_c is not None
    return reading.plate_c


# docs/physics.md 2.2: face after 1, 2 and 10 s from 33 degC, sink from 28 degC on 2 K/W.
@pytest.mark.parametrize(
    ("current_a", "after_1_s", "after_2_s", "after_10_s", "skin_after_1_s"),
    [
        (-0.5, 31.0, 29.7, 24.9, 31.6),
        (-1.0, 29.7, 27.5, 19.9, 30.6),
        (-1.5, 28.5, 25.5, 15.4, 29.7),
        (-2.0, 27.3, 23.6, 11.2, 28.9),
        (0.5, 33.8, 34.4, 36.2, 33.6),
        (0.75, 34.6, 35.6, 39.3, 34.1),
        (1.0, 35.3, 36.9, 42.6, 34.7),
    ],
)
def test_the_face_follows_the_reference_step_responses(
    current_a: float, after_1_s: float, after_2_s: float, after_10_s: float, skin_after_1_s: float
) -> None:
    plant = Plant(plate_c=33.0, sink_c=28.0)

    plant.step(current_a, 1.0)
    assert plant.plate_c == pytest.approx(after_1_s, abs=0.15)
    # That skin figure lies deeper than our surface, hence the wider tolerance.
    assert plant.skin_c == pytest.approx(skin_after_1_s, abs=0.45)
    plant.step(current_a, 1.0)
    assert plant.plate_c == pytest.approx(after_2_s, abs=0.15)
    plant.step(current_a, 8.0)
    assert plant.plate_c == pytest.approx(after_10_s, abs=0.35)


# docs/physics.md 2.3: steady face with the skin on; past the optimum, cooling heats.
@pytest.mark.parametrize(
    ("sink_k_per_w", "current_a", "steady_c", "tolerance_c"),
    [(5, 3, 9, 1), (5, 5, 20, 1), (5, 8, 65, 2), (8, 4, 30, 1), (8, 8, 135, 5)],
)
def test_a_weak_sink_turns_cooling_into_heating(
    sink_k_per_w: float, current_a: float, steady_c: float, tolerance_c: float
) -> None:
    plant = Plant(sink_k_per_w=sink_k_per_w)
    for _ in range(2000):
        plant.step(-current_a, 1.0)

    assert plant.plate_c == pytest.approx(steady_c, abs=tolerance_c)


def test_eight_ampere_of_cooling_first_cools_then_runs_away() -> None:
    plant = Plant(sink_k_per_w=5.0)
    plant.step(-8.0, 3.0)
    early_c = plant.plate_c
    for _ in range(1500):
        plant.step(-8.0, 1.0)

    assert early_c < 32.0
    assert plant.plate_c > 60.0
    assert plant.sink_c > 150.0


@pytest.mark.parametrize("ambient_c", [23.0, 32.0])
@pytest.mark.parametrize("sink_k_per_w", [2.0, 5.0])
def test_heating_stuck_on_at_the_current_limit_does_not_burn_at_room_temperature(
    ambient_c: float, sink_k_per_w: float
) -> None:
    plant = Plant(ambient_c, sink_k_per_w)
    for _ in range(2000):
        plant.step(0.75, 1.0)

    # Reference 3.4: at 32 degC ambient a fixed current limit no longer replaces the cut-off.
    assert (plant.plate_c < 43.0) == (ambient_c == 23.0)


@each(sink_k_per_w=[1.0, SINK_K_PER_W, 10.0], ambient_c=[15.0, 23.0, 30.0, 35.0])
def test_a_sink_at_its_trip_does_not_burn_through_the_open_bridge(
    ambient_c: float, sink_k_per_w: float
) -> None:
    plant = Plant(ambient_c, sink_k_per_w, plate_c=40.0, sink_c=44.0)
    skin_c = []
    for _ in range(9000):
        plant.step(0.0, 0.1)
        skin_c.append(plant.skin_c)

    assert max(skin_c) <= 43.0
    assert sum(0.25 ** (43.0 - felt_c) for felt_c in skin_c) / 600.0 <= 2.0


@pytest.mark.parametrize("current_a", [0.0, -2.0, 0.75, -8.0])
def test_energy_is_neither_made_nor_lost_without_a_hand(current_a: float) -> None:
    plant = Plant(palm_resistance=math.inf, plate_c=32.0, sink_c=25.0)
    supplied_j = lost_j = 0.0
    stored_before_j = FACE_J_PER_K * plant.plate_c + SINK_J_PER_K * plant.sink_c
    for _ in range(5_000):
        plant.step(current_a, 0.001)
        module_v = SEEBECK * (plant.plate_c - plant.sink_c) + current_a * RESISTANCE
        supplied_j += 0.001 * current_a * module_v
        lost_j += 0.001 * (plant.sink_c - 23.0) / SINK_K_PER_W
    stored_j = FACE_J_PER_K * plant.plate_c + SINK_J_PER_K * plant.sink_c - stored_before_j

    assert stored_j == pytest.approx(supplied_j - lost_j, abs=1e-6)


def test_the_steady_plate_obeys_the_datasheet_equation() -> None:
    plant = Plant(palm_resistance=math.inf)
    for _ in range(3000):
        plant.step(-1.0, 1.0)
    pumped_w = 0.01267 * (plant.plate_c + 273.15)
    back_w = 0.367 / 2 + 0.173 * (plant.sink_c - plant.plate_c)

    assert pumped_w == pytest.approx(back_w, abs=1e-6)


@each(current_a=[-2.0, 0.75, -8.0], step_s=[0.0005, 1 / 90, 0.02, 0.25, 1.0])
def test_the_step_size_does_not_matter(current_a: float, step_s: float) -> None:
    fine, plant = Plant(), Plant()
    for _ in range(4000):
        fine.step(current_a, 0.001)
    for _ in range(round(4.0 / step_s)):
        plant.step(current_a, step_s)

    assert plant.plate_c == pytest.approx(fine.plate_c, abs=0.05)
    assert plant.skin_c == pytest.approx(fine.skin_c, abs=0.05)
    assert plant.sink_c == pytest.approx(fine.sink_c, abs=0.05)


def test_a_palm_that_is_lifted_is_felt_no_more_from_the_next_step() -> None:
    reached_c = []
    for first_s in (0.02, 0.0201):
        plant = Plant()
        plant.step(1.0, first_s)
        plant.touch(math.inf)
        for _ in range(100):
            plant.step(1.0, 0.02)
        reached_c.append(plant.plate_c)
    assert reached_c[0] == pytest.approx(reached_c[1], abs=1e-2)


def test_time_that_does_not_pass_changes_nothing() -> None:
    plant = Plant()
    for dt_s in (0.0, -1.0, math.nan):
        plant.step(2.0, dt_s)

    assert plant.plate_c == 32.0


@pytest.mark.parametrize(
    ("setpoint_c", "within_s"), [(20.0, 4.0), (27.0, 2.0), (34.0, 4.0), (38.0, 20.0)]
)
def test_the_plate_reaches_its_setpoint_and_stays(setpoint_c: float, within_s: float) -> None:
    plate = SimulatedPlate()
    readings = hold(plate, setpoint_c, within_s + 10.0)

    late = readings[round(within_s / TICK_S) :]
    assert all(abs(plate_c(reading) - setpoint_c) < 0.3 for reading in late)
    assert not readings[-1].faults
    assert readings[-1].setpoint_c == setpoint_c


@pytest.mark.parametrize("setpoint_c", [18.0, 25.0, 38.0])
def test_overshoot_stays_below_what_skin_feels_twice(setpoint_c: float) -> None:
    readings = hold(SimulatedPlate(), setpoint_c, 30.0)
    beyond_c = max((plate_c(r) - setpoint_c) * (1 if setpoint_c > 32 else -1) for r in readings)

    assert beyond_c < 0.4


def test_an_unreachable_setpoint_does_not_wind_the_control_up() -> None:
    plate = SimulatedPlate(ambient_c=-8.0)
    unreached = hold(plate, 40.0, 30.0)
    assert unreached[-1].current_limited
    assert plate_c(unreached[-1]) < 38.0
    back = hold(plate, 28.0, 8.0, begin_s=30.0)

    assert plate_c(back[round(3.5 / TICK_S)]) == pytest.approx(28.0, abs=0.5)
    assert min(plate_c(reading) for reading in back) > 27.5


def test_the_current_stays_within_its_limits() -> None:
    cold, hot = hold(SimulatedPlate(), 18.0, 5.0), hold(SimulatedPlate(), 40.0, 5.0)

    assert -1.0 <= min(reading.duty for reading in cold) < -0.95
    assert max(reading.duty for reading in hot) == 1.0
    assert any(reading.current_limited for reading in hot)


def test_the_plate_limits_what_it_is_told() -> None:
    for told_c, setpoint_c in ((5.0, 18.0), (60.0, 40.0), (math.nan, 32.0), (math.inf, 32.0)):
        assert hold(SimulatedPlate(30.0), told_c, 20.0)[-1].setpoint_c == setpoint_c


def test_a_target_that_the_current_cannot_reach_waits_for_the_plate() -> None:
    readings = hold(SimulatedPlate(), 40.0, 1.0)
    ahead_c = [reading.setpoint_c - (reading.plate_c or 0.0) for reading in readings]

    assert readings[-1].setpoint_c < 40.0
    assert 0.3 < max(ahead_c) < 2.0  # 1.8 A are asked for from 1.8 degC on


def plate_a(reading: PlateReading) -> float:
    """Return the current, which a simulated plate always knows."""
    assert reading.current_a is not None
    return reading.current_a


@pytest.mark.parametrize(("sink_c", "most_a"), [(37.0, 3.0), (41.0, 1.5), (43.9, 0.03)])
def test_the_hotter_the_sink_the_less_the_plate_is_cooled(sink_c: float, most_a: float) -> None:
    plate = SimulatedPlate()
    plate._plant = Plant(ambient_c=sink_c, sink_c=sink_c)
    coldest_a = max(-plate_a(reading) for reading in hold(plate, 18.0, 0.5))

    assert 0.95 * most_a - 0.05 <= coldest_a <= most_a + 0.05


def test_the_setpoint_itself_moves_no_faster_than_the_slew_limit() -> None:
    readings = hold(SimulatedPlate(), 20.0, 2.0)
    steps = [a.setpoint_c - b.setpoint_c for a, b in itertools.pairwise(readings)]

    assert 5.0 * TICK_S < max(steps) <= COOL_SLEW_C_PER_S * TICK_S + 1e-9
    warmed = hold(SimulatedPlate(), 40.0, 2.0)
    rises = [b.setpoint_c - a.setpoint_c for a, b in itertools.pairwise(warmed)]
    assert max(rises) <= 12.0 * TICK_S + 1e-9


def test_the_service_may_command_more_often_than_a_board_takes_setpoints() -> None:
    """The feed-forward of a fall acts on steps, so a host that sends small ones would lose it."""
    ends_c = []
    for ticks in (1, 2):
        plate = SimulatedPlate(22.0)
        hold(plate, NEUTRAL_C, 10.0)
        for tick in range(round(0.6 / TICK_S)):
            now = 10.0 + tick * TICK_S
            if tick % ticks == 0:
                plate.command(NEUTRAL_C - 8.0 * tick * TICK_S, 0.25, now)
            plate.advance(now + TICK_S)
        ends_c.append(plate.skin_c)

    assert ends_c[0] == pytest.approx(ends_c[1], abs=0.06)  # a step may begin a tick sooner


def test_a_lapsed_lease_returns_to_neutral_and_opens_the_bridge() -> None:
    plate = SimulatedPlate()
    hold(plate, 22.0, 5.0)
    readings = leave(plate, 10.0, begin_s=5.0)

    assert readings[round(0.1 / TICK_S)].setpoint_c == 22.0
    assert readings[round(0.4 / TICK_S)].setpoint_c > 22.0
    assert max(plate_c(reading) for reading in readings) == pytest.approx(32.0, abs=0.5)
    assert readings[-1].duty == 0.0
    assert readings[-1].setpoint_c == 32.0


def test_rest_returns_to_neutral_at_once() -> None:
    plate = SimulatedPlate()
    hold(plate, 38.0, 10.0)
    plate.rest(10.0)
    readings = leave(plate, 10.0, begin_s=10.0)

    assert readings[10].setpoint_c < 38.0
    assert min(abs(plate_c(reading) - 32.0) for reading in readings) < 0.3
    assert readings[-1].duty == 0.0


def test_a_plate_that_drifted_cold_is_not_warmed_on_its_way_to_cold() -> None:
    plate = SimulatedPlate(ambient_c=18.0)
    drifted = leave(plate, 30.0, begin_s=0.0)[-1]
    assert plate_c(drifted) < 27.0
    readings = hold(plate, 20.0, 3.0, begin_s=30.0)

    assert max(reading.duty for reading in readings) <= 0.0
    assert max(reading.setpoint_c for reading in readings) < plate_c(drifted) + 0.5


def test_a_close_opens_the_bridge_at_once() -> None:
    plate = SimulatedPlate()
    hold(plate, 38.0, 2.0)
    plate.close()

    assert plate.advance(2.02).duty == 0.0


@pytest.mark.parametrize("ttl_s", [0.0, -1.0, math.nan, math.inf])
def test_a_command_without_a_sane_time_to_live_is_not_obeyed(ttl_s: float) -> None:
    plate = SimulatedPlate()
    plate.command(20.0, ttl_s, 0.0)

    assert plate.advance(0.5).setpoint_c == 32.0


def test_a_plate_never_commanded_does_nothing() -> None:
    assert all(reading.duty == 0.0 for reading in leave(SimulatedPlate(), 2.0, begin_s=0.0))


@pytest.mark.parametrize(
    ("stuck_c", "fault"),
    [(44.0, "over_temperature"), (43.0, "over_temperature"), (12.0, "under_temperature")],
)
def test_a_plate_trip_latches_until_cleared(stuck_c: float, fault: str) -> None:
    plate = SimulatedPlate(stuck_sensor_c=stuck_c)
    readings = hold(plate, 25.0, 1.0)

    assert readings[-1].faults == (fault,)
    assert all(reading.duty == 0.0 for reading in readings)
    assert not plate.clear(fault)
    assert plate.advance(2.0).faults == (fault,)


def test_a_sink_trip_latches_opens_the_bridge_and_survives_cooling_down() -> None:
    plate = SimulatedPlate()
    plate._plant = Plant(ambient_c=60.0, sink_c=45.5)
    hot = hold(plate, 32.0, 10.0)
    assert hot[-1].faults[0] == "sink_hot"
    assert hot[-1].duty == 0.0

    cooler = SimulatedPlate(ambient_c=56.0)
    assert hold(cooler, 32.0, 1.0)[-1].faults == ("sink_hot",)
    cooler._plant = Plant()
    assert leave(cooler, 1.0, begin_s=1.0)[-1].faults == ("sink_hot",)
    assert hold(cooler, 25.0, 1.0, begin_s=2.0)[-1].duty == 0.0
    assert cooler.clear("sink_hot")
    assert not leave(cooler, 0.5, begin_s=3.0)[-1].faults
    assert hold(cooler, 25.0, 5.0, begin_s=3.5)[-1].plate_c == pytest.approx(25.0, abs=0.3)


@pytest.mark.parametrize("jump_s", [-0.5, -1000.0, math.nan])
def test_a_clock_that_jumps_back_ends_the_lease(jump_s: float) -> None:
    plate = SimulatedPlate()
    before_c = plate_c(hold(plate, 20.0, 3.0)[-1])
    jumped = plate.advance(3.0 + jump_s)
    readings = leave(plate, 8.0, begin_s=3.0 + jump_s if math.isfinite(jump_s) else 3.0)

    assert plate_c(jumped) == pytest.approx(before_c, abs=0.01)
    assert readings[-1].setpoint_c == 32.0
    assert readings[-1].duty == 0.0


@pytest.mark.parametrize("gap_s", [2.0, 10.0, 1e6])
def test_a_gap_lapses_the_lease_and_is_lived_through_in_small_steps(gap_s: float) -> None:
    plate, steady = SimulatedPlate(), SimulatedPlate()
    hold(plate, 20.0, 4.0)
    hold(steady, 20.0, 4.0)
    after = plate.advance(4.0 + gap_s)
    expected = leave(steady, min(gap_s, 5.0), begin_s=4.0)[-1]

    assert after.setpoint_c > 20.0
    assert plate_c(after) == pytest.approx(plate_c(expected), abs=1.0)
    assert not after.faults


def test_a_command_after_a_gap_holds_from_now_on() -> None:
    plate, idle = SimulatedPlate(), SimulatedPlate()
    plate.advance(0.0)
    idle.advance(0.0)
    plate.command(20.0, 0.25, 4.0)
    drifted_c = plate_c(leave(idle, 4.0, begin_s=0.0)[-1])

    assert plate_c(plate.advance(4.0)) == pytest.approx(drifted_c, abs=0.01)
    assert drifted_c < 31.0
    assert plate.advance(4.2).setpoint_c == pytest.approx(
        drifted_c - 0.2 * COOL_SLEW_C_PER_S, abs=0.05
    )


def test_heated_time_counts_heat_only() -> None:
    warm = hold(SimulatedPlate(), 36.0, 10.0)[-1]

    assert warm.heated_s == pytest.approx(10.0, abs=0.2)
    assert hold(SimulatedPlate(), 32.0, 5.0)[-1].heated_s == 0.0
    assert hold(SimulatedPlate(), 25.0, 5.0)[-1].heated_s == 0.0


def test_used_up_heat_leaves_the_plate_at_neutral() -> None:
    plate = SimulatedPlate()
    plate._heated_s = 899.0
    readings = hold(plate, 36.0, 8.0)

    assert readings[-1].setpoint_c == 32.0
    assert plate_c(readings[-1]) == pytest.approx(32.0, abs=0.3)
    assert hold(plate, 25.0, 5.0, begin_s=8.0)[-1].setpoint_c == 25.0


# docs/physics.md 3.1: time to 2 CEM43 is 32, 8, 2, 1 and 0.5 min at 41, 42, 43, 44 and 45 degC.
@pytest.mark.parametrize(
    ("skin_c", "minutes"), [(41.0, 32.0), (42.0, 8.0), (43.0, 2.0), (44.0, 1.0), (45.0, 0.5)]
)
def test_the_dose_is_cem43_of_the_skin(
    skin_c: float, minutes: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Plant, "skin_c", property(lambda _: skin_c))
    plate = SimulatedPlate()
    reading = leave(plate, minutes, begin_s=0.0)[-1]

    assert reading.dose_cem43 * 60.0 == pytest.approx(2.0, rel=0.05)


@pytest.mark.parametrize("make", [SimulatedPlate, lambda: SimulatedPlate(ambient_c=35.0)])
def test_two_plates_with_the_same_past_are_equal(make: Callable[[], SimulatedPlate]) -> None:
    assert hold(make(), 24.0, 2.0) == hold(make(), 24.0, 2.0)


def test_a_rest_as_long_as_a_session_gives_its_heat_back_and_a_shorter_one_does_not() -> None:
    plate = SimulatedPlate()
    now = 0.0
    for _ in range(100):
        now += 0.1
        plate.command(38.0, 0.5, now)
    used = plate.advance(now)
    assert used.heated_s > 5.0
    for _ in range(int(REST_S * 0.9)):
        now += 1.0
        short = plate.advance(now)
    assert short.heated_s >= used.heated_s
    for _ in range(int(REST_S * 0.2)):
        now += 1.0
        rested = plate.advance(now)
    assert rested.heated_s == 0.0
