"""Models the parts between chip and skin: thermistors, driver, limiter, cut-out, dose of the palm.

The parts are those of firmware/PROTOCOL.md and firmware/README.md. Heat flow is in the project's
plant model, `hapticvlm.devices.simulated.plant`, and is not repeated here. Values marked
[assumption] were not measured.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from hapticvlm.devices.simulated.plant import Bead

SUPPLY_MV = 5000.0
DIVIDER_OHM, R25_OHM, BETA_K, OTHER_BETA_K = 10e3, 10e3, 3950.0, 3435.0
COLDEST_C = -100.0  # lower limit of a drifting reading
PLATE_A, PLATE_B, SINK, CUT_OUT = 0, 1, 2, 3  # ADC channels
NOISE_MV = 2.0  # standard deviation at the ADC pin [assumption]

FULL_SCALE_A = 3.0  # module current at duty 1
HEAT_LIMIT_A, COOL_LIMIT_A = 1.8, 3.0  # the firmware's limits
# The passive limiter works whatever the chip does. It is on the module's own leads beyond the
# plug, so it follows the module's polarity and survives a shorted FET: an [assumption] of
# firmware/README.md.
SUPPLY_V, MODULE_OHM, LEADS_OHM = 5.0, 0.367, 0.1
SENSE_OHM, CHOKE_OHM = 0.05, 0.05  # of the driver, one and two of them; a shorted FET leaves them
FETS_OHM = 0.15  # two switches of a driver that still works [assumption]
SERIES_OHM, BYPASS_OHM = 2.0, 1.36  # R13, R14
DIODE_V, DIODE_OHM = 0.38, 0.04  # D1 from half an ampere on [assumption]
# The plate of one resistor: R13 alone, behind a bridge that pulses the supply.
ONE_SCALE_A, ONE_SERIES_OHM = 0.72, 6.2
BRIDGE_OHM = 0.36  # two switches of a DRV8833 [assumption, from memory]
ONE_STRONGEST = 1.1  # of a shorted bridge: supply and resistor at their tolerances, 5 % each

# 15 min at 41.55 degC are 2 CEM43. Cold is as near the coldest setpoint, 18 degC, as the 1 % of two
# thermistors lets it be.
CUT_OUT_HOT_C, CUT_OUT_COLD_C = 41.5, 17.0  # [assumption]
CUT_OUT_TOLERANCE_C = 0.6  # its thermistor's: the simulated one opens that late
CUT_OUT_LAG_S = 1.0  # of its thermistor: the most that the first switch-on allows, step 6
RELEASE_S = 0.02  # of its relay [assumption]
CUT_OUT_BETA_K, CUT_OUT_R25_OHM = 4267.0, 100e3  # with 100 kohm to the board's supply


def thermistor_mv(temperature_c: float, beta_k: float = BETA_K) -> float:
    """Return the voltage at the ADC pin: thermistor to ground, its R25 to the supply."""
    temperature_c = max(temperature_c, COLDEST_C)
    ratio = math.exp(beta_k * (1.0 / (temperature_c + 273.15) - 1.0 / 298.15))
    return SUPPLY_MV * ratio / (ratio + 1.0)


def taken_for_c(true_c: float, beta_k: float, taken_for_k: float) -> float:
    """Return the reading of a bead of `beta_k` at `true_c` when another beta is assumed."""
    inverse = 1.0 / 298.15
    inverse += beta_k / taken_for_k * (1.0 / (true_c + 273.15) - 1.0 / 298.15)
    return 1.0 / inverse - 273.15


class CutOut:
    """Window comparator with its own thermistor, and a relay that holds itself, in series with the
    module: once open it stays open until its button is pressed.

    The relay holds only while its thermistor is within the window and the firmware permits it.
    `reads` converts the bead's temperature to the one its dividers represent, `feels` the plate's
    to that of the surface on which the bead is. Failed parts: `is_welded` is its switching contact
    (force guidance then keeps the break contact open), `is_stuck` comparator or transistor, and
    `ignores_firmware` the transistor of the firmware.
    """

    def __init__(self, plate_c: float, lag_s: float = CUT_OUT_LAG_S) -> None:
        self.bead = Bead(plate_c, lag_s)
        self.is_open = True
        self.is_pressed = False  # its start button
        self.is_permitted = False
        self.has_tripped = False
        self.is_welded = self.is_stuck = self.ignores_firmware = False
        self.reads: Callable[[float], float] = float
        self.feels: Callable[[float], float] = float
        self._released_s = 0.0

    def feel(self, plate_c: float, dt_s: float) -> None:
        """Let `dt_s` pass beside a plate at `plate_c`."""
        self.bead.feel(self.feels(plate_c), dt_s)
        read_c = self.reads(self.bead.c)
        late_c = CUT_OUT_TOLERANCE_C
        within = CUT_OUT_COLD_C - late_c < read_c < CUT_OUT_HOT_C + late_c
        holds = (within or self.is_stuck) and (self.is_permitted or self.ignores_firmware)
        self.has_tripped |= not self.is_open and not within and not self.is_stuck
        self._released_s = 0.0 if holds else self._released_s + dt_s
        if self._released_s >= RELEASE_S:
            self.is_open = True
        elif holds and self.is_pressed:
            self.is_open = False
        self.is_open &= not self.is_welded


@dataclass(frozen=True)
class Limiter:
    """R13 in the module's lead; beside it, while it is cooled, D1 with R14."""

    series_ohm: float = SERIES_OHM
    bypass_ohm: float = BYPASS_OHM
    diode_v: float = DIODE_V
    diode_shorted: bool = False

    def most_a(self, source_v: float, inner_ohm: float, *, heats: bool) -> float:
        """Return the current that a voltage behind a resistance drives through it."""
        if source_v <= 0.0:
            return 0.0
        diode_v, bypass_ohm = self.diode_v, self.bypass_ohm + DIODE_OHM
        if self.diode_shorted:
            diode_v, bypass_ohm = 0.0, self.bypass_ohm
        alone_v = source_v * self.series_ohm / (inner_ohm + self.series_ohm)
        if alone_v <= diode_v or (heats and not self.diode_shorted):
            return (source_v - alone_v) / inner_ohm
        fed_a = source_v / inner_ohm + diode_v / bypass_ohm
        drop_v = fed_a / (1.0 / inner_ohm + 1.0 / self.series_ohm + 1.0 / bypass_ohm)
        return (source_v - drop_v) / inner_ohm


@dataclass
class Driver:
    """Bridge, plug and limiter: mean duty -1..1 to current through the module, in ampere.

    The driver controls its current as far as supply, limiter and the module's own voltage let it.
    `shorted` is the direction (1 heats, -1 cools) that two failed FETs conduct in for good,
    whatever the chip does. `polarity` is -1 when the plug is reversed, 0 when it is out. An ideal
    one gives what the firmware may ask for.
    """

    polarity: int = 1
    shorted: int = 0
    is_ideal: bool = False
    limiter: Limiter = Limiter()
    full_scale_a: float = FULL_SCALE_A
    has_one_resistor: bool = False  # and pulses its supply instead of controlling a current

    def current_a(self, duty: float, emf_v: float = 0.0) -> float:
        """Return the current into the module, heating the plate when positive.

        `emf_v` is the module's own voltage, positive when its plate is hotter than the sink.
        """
        cool_a, heat_a = self._most_a(emf_v)
        if self.has_one_resistor and not self.shorted:
            pulsed = self.polarity * duty
            return pulsed * (heat_a if pulsed > 0.0 else cool_a)
        return min(max(self._wanted_a(duty), -cool_a), heat_a)

    def is_limiting(self, duty: float) -> bool:
        """Return whether the passive limiter reduces the current below the firmware's limits."""
        return not -COOL_LIMIT_A <= self._wanted_a(duty) <= HEAT_LIMIT_A

    def _wanted_a(self, duty: float) -> float:
        if not self.polarity:
            return 0.0
        return self.polarity * (
            self.shorted * math.inf if self.shorted else duty * self.full_scale_a
        )

    def _most_a(self, emf_v: float) -> tuple[float, float]:
        """Return the current limits of cooling and heating."""
        if self.is_ideal:
            return COOL_LIMIT_A, HEAT_LIMIT_A
        if self.has_one_resistor:
            ohm = MODULE_OHM + LEADS_OHM + self.limiter.series_ohm
            ohm = ohm / ONE_STRONGEST if self.shorted else ohm + BRIDGE_OHM
            return (SUPPLY_V + emf_v) / ohm, (SUPPLY_V - emf_v) / ohm
        inner = MODULE_OHM + LEADS_OHM + SENSE_OHM + 2.0 * CHOKE_OHM
        inner += 0.0 if self.shorted else FETS_OHM
        return (
            self.limiter.most_a(SUPPLY_V + emf_v, inner, heats=False),
            self.limiter.most_a(SUPPLY_V - emf_v, inner, heats=True),
        )


def one_resistor() -> Driver:
    """Return the bridge of the plate of one resistor."""
    limiter = Limiter(series_ohm=ONE_SERIES_OHM)
    return Driver(limiter=limiter, full_scale_a=ONE_SCALE_A, has_one_resistor=True)


@dataclass
class Skin:
    """The extremes of the skin surface and its dose in minutes at 43 degC (CEM43)."""

    lowest_c: float = math.inf
    highest_c: float = -math.inf
    dose_cem43: float = 0.0

    def feel(self, skin_c: float, dt_s: float) -> None:
        """Add `dt_s` at `skin_c`."""
        self.lowest_c = min(self.lowest_c, skin_c)
        self.highest_c = max(self.highest_c, skin_c)
        self.dose_cem43 += self.rate(skin_c) * dt_s

    @staticmethod
    def rate(skin_c: float) -> float:
        """Return the dose of a second at `skin_c`."""
        halving = 0.5 if skin_c >= 43.0 else 0.25
        return float(halving ** (43.0 - skin_c) / 60.0)
