"""The phase margin of the control loop, from the gains in core/loop.cpp and the plant's equations.

The loop is linear around a working point: the module pumps W watt into the face for each ampere,
the face of C J/K is joined to the sink by the module's conductance and to the palm's skin, a row of
cells. The bead follows the face with its lag. A reading is the mean over a step, and its current
flows in the next one. The margin is the phase that could be lost before the loop rings.
"""

from __future__ import annotations

import math
from itertools import product

import numpy as np
import pytest
from numpy.typing import NDArray

from hapticvlm.devices.simulated.plant import RESISTANCE, SEEBECK, Module, Plant

from .build import constant
from .hardware import CutOut, Driver, Limiter, Skin
from .situations import PRESSED, hold_for_a_minute

STEP_S = 0.02
DRIVER_RAD_S = 2.0 * math.pi * 64.0  # the filter of its control voltage
RATES = np.geomspace(0.05, math.pi / STEP_S * 0.999, 400)  # rad/s
# Current in A, plate and sink in degC: warm, cold, and near rest, where an ampere moves most.
WORKING_POINTS = ((0.4, 36.0, 26.0), (-1.0, 24.0, 30.0), (-0.2, 30.0, 25.0))
PALMS = (math.inf, 5e-4, 2e-4, 5e-5)  # m2 K/W

Complexes = NDArray[np.complex128]


def controller(lag_s: float, untold: str = "") -> Complexes:
    """Return the response from a reading to the current, (rates,), A/K."""
    z = np.exp(1j * RATES * STEP_S)
    filter_s = constant("FACE_FILTER_S")
    share = STEP_S / filter_s
    slope = (1.0 - 1.0 / z) / STEP_S * share / (1.0 - (1.0 - share) / z)
    gain_p, gain_i = (constant(f"{untold}GAIN_{part}", "loop.cpp") for part in "PI")
    gain = gain_p + gain_i * STEP_S * z / (z - 1.0)
    return np.asarray(gain * (1.0 + (lag_s + filter_s) * slope))


def face(point: tuple[float, float, float], face_j_per_k: float, palm: float) -> Complexes:
    """Return the response from the current to the face, (rates,), K/A."""
    current_a, plate_c, sink_c = point
    plant = Plant(palm_resistance=palm, module=Module(face_j_per_k=face_j_per_k))
    system = -plant._flow.copy()
    system[0, 0] += SEEBECK * current_a
    system[1, 1] -= SEEBECK * current_a
    drive = np.zeros(len(system))
    drive[0] = RESISTANCE * current_a - SEEBECK * (sink_c + 273.15)
    drive[1] = RESISTANCE * current_a + SEEBECK * (plate_c + 273.15)
    stored = 1j * RATES[:, None, None] * np.diag(plant._capacity)
    return np.asarray(np.linalg.solve(system + stored, drive[:, None])[:, 1, 0])


def margin_deg(
    face_per_a: Complexes, bead_lag_s: float, told_lag_s: float, untold: str = ""
) -> float:
    """Return the phase margin in degrees."""
    s = 1j * RATES
    hold = (1.0 - np.exp(-s * STEP_S)) / (s * STEP_S)  # of a current during a step
    mean = hold  # of the readings in a step
    loop = face_per_a / (1.0 + s * bead_lag_s) * hold * mean * np.exp(-s * STEP_S)
    loop = loop / (1.0 + s / DRIVER_RAD_S) * controller(told_lag_s, untold)
    phase = np.unwrap(np.angle(loop))
    phase -= 2.0 * math.pi * round((phase[0] + math.pi / 2.0) / (2.0 * math.pi))
    falls = np.nonzero((np.abs(loop[:-1]) >= 1.0) & (np.abs(loop[1:]) < 1.0))[0]
    return float(min(180.0 + np.degrees(phase[falls])))


@pytest.mark.parametrize("face_j_per_k", [0.6, 1.0, 1.5])
def test_the_loop_keeps_45_degrees_with_every_bead_that_it_knows(face_j_per_k: float) -> None:
    margins = {}
    for point, palm in product(WORKING_POINTS, PALMS):
        face_per_a = face(point, face_j_per_k, palm)
        for lag_s in (0.0, 0.1, 0.3, 0.6, 1.0):
            margins[point, palm, lag_s] = margin_deg(face_per_a, lag_s, lag_s)

    print(min(margins.values()))
    assert min(margins.values()) >= 45.0


def test_a_lag_that_is_measured_wrong_by_its_error_leaves_35_degrees() -> None:
    # Of 0.05 s, as `calibrate plate` measures it.
    margins = [
        margin_deg(face(point, face_j_per_k, palm), lag_s + wrong_s, lag_s)
        for point, palm, face_j_per_k, lag_s, wrong_s in product(
            WORKING_POINTS, PALMS, (0.6, 1.0, 1.5), (0.1, 0.3, 0.6, 0.95), (-0.05, 0.05)
        )
    ]

    print(min(margins))
    assert min(margins) >= 35.0


def test_a_board_that_was_not_told_its_lag_keeps_35_degrees_with_every_bead() -> None:
    told_s = constant("USUAL_LAG_MS") / 1000.0
    margins = [
        margin_deg(face(point, face_j_per_k, palm), lag_s, told_s, "UNTOLD_")
        for point, palm, face_j_per_k, lag_s in product(
            WORKING_POINTS, PALMS, (0.6, 1.0, 1.5), (0.0, 0.1, 0.3, 0.6, 1.0)
        )
    ]

    print(min(margins))
    assert min(margins) >= 35.0


@pytest.mark.parametrize("start_c", [18.0, 21.0, 22.0, 24.0, 26.0, 32.0])
@pytest.mark.parametrize("face_j_per_k", [0.6, 1.0, 1.5])
def test_a_shorted_bridge_leaves_a_pressed_palm_above_13_degrees(
    face_j_per_k: float, start_c: float
) -> None:
    coldest_c, _ = skin_of_a_shorted_bridge(-1, 15.0, start_c, face_j_per_k)

    assert coldest_c >= 13.0


@pytest.mark.parametrize("start_c", [38.0, 40.0])
@pytest.mark.parametrize("face_j_per_k", [0.6, 1.0, 1.5])
def test_a_shorted_bridge_leaves_a_pressed_palm_below_42_degrees(
    face_j_per_k: float, start_c: float
) -> None:
    _, hottest_c = skin_of_a_shorted_bridge(1, 30.0, start_c, face_j_per_k)

    assert hottest_c <= 42.0


def skin_of_a_shorted_bridge(
    way: int, room_c: float, start_c: float, face_j_per_k: float
) -> tuple[float, float]:
    """Hold a plate under a pressed palm for a minute, short its bridge; return the skin's extremes.

    `way` is that of `Driver.shorted`; the extremes are of the time from the short on, in degC.
    """
    low_c, high_c = (constant(f"FACE_TRIP_{side}_C") for side in ("LOW", "HIGH"))
    late_s = constant("FACE_TRIP_MS") / 1000.0 + 2.0 * STEP_S  # of the firmware, and its steps
    plant = Plant(
        room_c, palm_resistance=PRESSED, plate_c=32.0, module=Module(face_j_per_k=face_j_per_k)
    )
    hold_for_a_minute(plant, start_c, -2.0, 0.75)
    assert plant.plate_c == pytest.approx(start_c, abs=0.3)
    driver = Driver(shorted=way, limiter=Limiter(diode_v=0.3))
    cut_out = CutOut(plant.plate_c)
    cut_out.is_open = False
    beyond_s = 0.0
    skin = Skin()
    for _ in range(1500):
        emf_v = SEEBECK * (plant.plate_c - plant.sink_c)
        plant.step(0.0 if cut_out.is_open else driver.current_a(0.0, emf_v), 0.01)
        beyond_s = beyond_s + 0.01 if not low_c < plant.plate_c < high_c else 0.0
        cut_out.is_permitted = beyond_s < late_s
        cut_out.feel(plant.plate_c, 0.01)
        skin.feel(plant.skin_c, 0.01)

    print(skin)
    assert cut_out.is_open
    return skin.lowest_c, skin.highest_c
