"""Calibration finds a planted contact resistance, says how sure it is, and listens to a person."""

from __future__ import annotations

import functools
import json
import time

import numpy as np
import pytest

from hapticvlm.commands.main import main
from hapticvlm.devices.simulated.simulated import SimulatedPlate
from hapticvlm.materials import MATERIALS
from hapticvlm.perception import NEUTRAL_C
from hapticvlm.rendering.heat.contact import skin_surface_c, thermal_contact
from hapticvlm.rendering.heat.limits import limit
from hapticvlm.rendering.heat.trajectory import ThermalTrajectory
from hapticvlm_studio.calibration.contact_estimate import (
    JUDGED_S,
    RESISTANCES,
    TRIALS,
    ContactEstimator,
    SimulatedPalm,
    colder_chance,
)
from hapticvlm_studio.calibration.plate_driver import PlateDriver
from hapticvlm_studio.commands import calibrate_thermal as thermal

METAL = MATERIALS["metal"].thermal
TICK_S = 0.02


def on_plate(tried: float, palm_resistance: float, compensated: float) -> float:
    """Skin of a palm laid on a plate that waited for it, JUDGED_S later, degC above its rest + 32.

    The palm has rested at neutral before; the plant's skin is put back to that when it is laid on.
    """
    plate, now, setpoint_c = SimulatedPlate(22.0, palm_resistance=palm_resistance), 0.0, NEUTRAL_C
    plant, contact = plate._plant, thermal_contact(METAL, 22.0, contact_resistance=tried)
    for _ in range(250):
        plate.command(NEUTRAL_C, 1.0, now)
        plate.advance(now)
        now += TICK_S
    rested, rested_c = plant._state_c[2:].copy(), plant.skin_c
    plant.touch(np.inf)
    course = ThermalTrajectory(plate_resistance=compensated).approach(contact, now)
    for tick in range(round((thermal.PRECONDITION_S + JUDGED_S) / TICK_S)):
        if tick == round(thermal.PRECONDITION_S / TICK_S):
            plant._state_c[2:] = rested
            plant.touch(palm_resistance)
            course = course.touch(contact, "plate", now)
        setpoint_c = limit(course.target_c(now), setpoint_c, TICK_S, plate.advance(now)).setpoint_c
        plate.command(setpoint_c, 0.25, now)
        now += TICK_S
    plate.advance(now)
    return plant.skin_c - rested_c + NEUTRAL_C


def calibrated_on_plate(planted, palm_resistance, compensated, seed):
    """Let a palm answer that feels the plant; the share of its R'' that is found."""
    felt = functools.cache(lambda tried: on_plate(tried, palm_resistance, compensated))
    real_c = skin_surface_c(thermal_contact(METAL, 22.0, contact_resistance=planted), JUDGED_S)
    calibration, rng = ContactEstimator(METAL, 22.0), np.random.default_rng(seed)
    for _ in range(TRIALS):
        tried = calibration.next_resistance()
        chance = colder_chance(np.array(felt(tried) - real_c), np.array(0.3))
        calibration.learn(tried, real_was_colder=bool(rng.random() < chance))
    return calibration.estimate().contact_resistance / planted


@pytest.mark.parametrize("planted", [5.5e-4, 2e-3])
@pytest.mark.parametrize("palm_resistance", [2e-4, 5e-4])
def test_a_palm_that_lies_on_the_plant_is_found_when_the_plate_compensates_it(
    planted, palm_resistance
):
    found = [
        calibrated_on_plate(planted, palm_resistance, palm_resistance, seed) for seed in range(3)
    ]

    assert np.median(found) == pytest.approx(1.0, rel=0.3)


def test_what_the_plate_does_not_compensate_is_taken_for_a_better_contact():
    assert calibrated_on_plate(5.5e-4, 5e-4, 0.0, seed=0) < 0.5


def test_the_driver_goes_ahead_of_the_skin_as_the_service_does():
    coldest = {}
    for resistance in (0.0, 1e-3):
        plate = Notes()
        driver = PlateDriver(plate, resistance)
        driver.prepare(thermal_contact(METAL, 22.0))
        until = time.monotonic() + 2.0
        while time.monotonic() < until:
            time.sleep(0.05)
        driver.close()
        coldest[resistance] = min(plate.setpoints)

    assert coldest[1e-3] < coldest[0.0] - 2.0


def calibrated(planted: float, noise_c: float = 0.3, seed: int = 0, trials: int = TRIALS):
    """Let a simulated palm answer; return the estimate."""
    calibration, palm = ContactEstimator(METAL, 22.0), SimulatedPalm(planted, noise_c, seed)
    for _ in range(trials):
        tried = calibration.next_resistance()
        answer = palm.is_real_colder(METAL, 22.0, tried)
        calibration.learn(tried, real_was_colder=answer)
    return calibration.estimate()


@pytest.mark.parametrize("planted", [3e-4, 5.5e-4, 1e-3, 2.5e-3, 6e-3])
def test_a_planted_resistance_is_found_within_a_quarter(planted):
    ratios = [calibrated(planted, seed=seed).contact_resistance / planted for seed in range(6)]

    assert 0.75 < np.median(ratios) < 1.25
    assert all(0.6 < ratio < 1.5 for ratio in ratios)


@pytest.mark.parametrize("noise_c", [0.3, 1.2])
def test_the_interval_holds_the_planted_value_nearly_always(noise_c):
    found = [calibrated(1e-3, noise_c, seed) for seed in range(12)]

    assert sum(one.low <= 1e-3 <= one.high for one in found) >= 10


def test_a_very_good_contact_is_found_to_a_factor_and_said_to_be_uncertain():
    found = calibrated(1e-4, seed=1)

    assert found.high / found.low > 2.0
    assert 0.3 < found.contact_resistance / 1e-4 < 3.0


def test_more_answers_narrow_the_interval():
    few, many = (calibrated(1e-3, trials=trials) for trials in (4, 30))

    assert few.high / few.low > 1.5 * many.high / many.low
    assert (few.trials, many.trials) == (4, 30)


def test_a_noisy_palm_is_known_to_be_noisy():
    quiet = np.mean([calibrated(1e-3, 0.15, seed, 30).noise_c for seed in range(4)])
    noisy = np.mean([calibrated(1e-3, 2.4, seed, 30).noise_c for seed in range(4)])

    assert noisy > 2.0 * quiet


def test_nothing_answered_leaves_everything_open():
    found = ContactEstimator(METAL, 22.0).estimate()

    assert found.low < 2 * RESISTANCES[0]
    assert found.high > RESISTANCES[-1] / 2
    assert found.trials == 0


@pytest.mark.parametrize("always", [True, False])
def test_a_person_who_always_says_the_same_ends_at_an_edge_and_breaks_nothing(always):
    calibration = ContactEstimator(METAL, 22.0)
    for _ in range(40):
        calibration.learn(calibration.next_resistance(), real_was_colder=always)
    found = calibration.estimate()

    assert np.isfinite([found.contact_resistance, found.low, found.high]).all()
    assert (found.contact_resistance < 2e-4) == always


def test_what_is_colder_by_much_is_called_colder_and_alike_is_a_coin():
    assert colder_chance(np.array(5.0), np.array(0.3)) > 0.95
    assert colder_chance(np.array(0.0), np.array(0.3)) == pytest.approx(0.5)


def test_the_command_prints_the_value_with_its_interval(capsys, tmp_path):
    out = tmp_path / "palm.json"
    assert main(["calibrate", "thermal", "--simulate", "1.2e-3", "--out", str(out)]) == 0

    said = capsys.readouterr().out.strip().splitlines()
    told = json.loads(out.read_text())
    assert told["simulated"] is True
    assert told["trials"] == TRIALS
    assert told["low"] <= told["contact_resistance"] <= told["high"]
    assert told["contact_resistance"] == pytest.approx(1.2e-3, rel=0.5)
    assert any("--contact-resistance" in line for line in said)


def test_the_same_seed_repeats(capsys):
    def told():
        assert main(["calibrate", "thermal", "--simulate", "8e-4", "--seed", "3", "--json"]) == 0
        return capsys.readouterr().out

    assert told() == told()


@pytest.mark.parametrize(
    "wrong",
    [
        ["--ambient-c", "31"],
        ["--ambient-c", "nan"],
        ["--trials", "0"],
        ["--simulate", "5"],
        ["--object", "unobtainium"],
    ],
)
def test_what_cannot_work_is_refused_before_a_plate_is_touched(wrong, capsys):
    assert main(["calibrate", "thermal", *wrong]) == 2
    assert wrong[0] in capsys.readouterr().err


def test_a_person_answers_at_the_terminal_with_a_simulated_plate(monkeypatch, capsys):
    monkeypatch.setattr(thermal, "PRECONDITION_S", 0.05)
    monkeypatch.setattr(thermal, "TOUCH_S", 0.05)
    answers = iter(["", "", "what", "a", "", "", "B", "", "", "q"])
    monkeypatch.setattr("builtins.input", lambda _: next(answers))

    assert main(["calibrate", "thermal", "--peltier", "simulated"]) == 0
    said = capsys.readouterr().out
    assert "rehearsal" in said
    assert "after 2 trials" in said


def test_a_terminal_that_closes_ends_the_calibration(monkeypatch, capsys):
    def closed(_):
        raise EOFError

    monkeypatch.setattr("builtins.input", closed)
    assert main(["calibrate", "thermal", "--peltier", "simulated"]) == 2
    assert "no more answers" in capsys.readouterr().err


class Notes(SimulatedPlate):
    """A simulated plate that writes down what it was told."""

    def __init__(self):
        super().__init__()
        self.setpoints: list[float] = []
        self.rested = False

    def command(self, setpoint_c, ttl_s, now):
        self.setpoints.append(setpoint_c)
        super().command(setpoint_c, ttl_s, now)

    def rest(self, now):
        self.rested = True
        super().rest(now)


def test_the_driver_cools_for_a_touch_and_rests_the_plate_at_the_end():
    plate = Notes()
    driver = PlateDriver(plate)
    driver.prepare(thermal_contact(METAL, 22.0))
    driver.touch()
    while not plate.setpoints or plate.setpoints[-1] > 31.5:
        assert len(plate.setpoints) < 3000
        time.sleep(0.01)
    driver.release()
    driver.close()

    assert plate.rested
    assert min(plate.setpoints) >= 18.0
