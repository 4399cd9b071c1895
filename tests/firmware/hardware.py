"""Models the parts between chip and skin: thermistors, driver, limiter, cut-out, dose of the palm.

The parts are those of firmware/PROTOCOL.md and firmware/README.md. Heat flow is in the project's
plant model, `hapticvlm.devices.simulated.plant`, and is not repeated here. Values marked
[assumption] were not measured.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

from hapticvlm.devices.simulated.limiter import SERIES_OHM, Limiter

SUPPLY_MV = 5000.0
DIVIDER_OHM, R25_OHM, BETA_K, OTHER_BETA_K = 10e3, 10e3, 3950.0, 3435.0
COLDEST_C = -100.0  # lower limit of a drifting reading
PLATE_A, PLATE_B, SINK = 0, 1, 2  # ADC channels
NOISE_MV = 2.0  # standard deviation at the ADC pin [assumption]

FULL_SCALE_A = 3.0  # module current at duty 1
HEAT_LIMIT_A, COOL_LIMIT_A = 0.75, 2.0  # the firmware's limits
BURST_LIMIT_A = 3.0  # of cooling, while the store fills
# The passive limiter works whatever the chip does. It is on the module's own leads beyond the
# plug, so it follows the module's polarity and survives a shorted FET: an [assumption] of
# firmware/README.md.
SUPPLY_V, MODULE_OHM, LEADS_OHM = 5.0, 0.367, 0.1
SENSE_OHM, CHOKE_OHM = 0.05, 0.05  # of the driver, one and two of them; a shorted FET leaves them
FETS_OHM = 0.15  # two switches of a driver that still works [assumption]

# 15 min at 41.55 degC are 2 CEM43. Cold is as near the coldest setpoint, 18 degC, as the 1 % of two
# thermistors lets it be: 2 A cool the skin by another 4 degC before a slow bead has felt it
CUT_OUT_HOT_C, CUT_OUT_COLD_C = 41.5, 17.0  # [assumption]
# Of its own thermistor: a build has to show 1 s at its first switch-on [assumption]
CUT_OUT_LAG_S = 1.5
MOST_CUT_OUT_LAG_S = 1.0  # that the first switch-on allows (firmware/README.md, step 6)


def thermistor_mv(temperature_c: float, beta_k: float = BETA_K) -> float:
    """Return the voltage at the ADC pin: thermistor to ground, DIVIDER_OHM to the supply."""
    temperature_c = max(temperature_c, COLDEST_C)
    ohm = R25_OHM * math.exp(beta_k * (1.0 / (temperature_c + 273.15) - 1.0 / 298.15))
    return SUPPLY_MV * ohm / (ohm + DIVIDER_OHM)


def taken_for_c(true_c: float, beta_k: float, taken_for_k: float) -> float:
    """Return the reading of a bead of `beta_k` at `true_c` when another beta is assumed."""
    inverse = 1.0 / 298.15
    inverse += beta_k / taken_for_k * (1.0 / (true_c + 273.15) - 1.0 / 298.15)
    return 1.0 / inverse - 273.15


class CutOut:
    """Window comparator with its own thermistor and a relay that holds itself, in series with
    the module: once open it stays open until its button is pressed.

    `reads` converts the bead's temperature to the one its dividers represent.
    """

    def __init__(self, plate_c: float, lag_s: float = CUT_OUT_LAG_S) -> None:
        self._bead_c = plate_c
        self._lag_s = lag_s
        self.is_open = False
        self.is_welded = (
            False  # its switching contact; force guidance then keeps the break contact open
        )
        self.reads: Callable[[float], float] = float

    def feel(self, plate_c: float, dt_s: float) -> None:
        """Let `dt_s` pass beside a plate at `plate_c`."""
        self._bead_c += (plate_c - self._bead_c) * min(dt_s / self._lag_s, 1.0)
        if not self.is_welded and not CUT_OUT_COLD_C < self.reads(self._bead_c) < CUT_OUT_HOT_C:
            self.is_open = True


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
    limiter: Limiter = field(default_factory=Limiter)

    def carry(self, current_a: float, dt_s: float) -> None:
        """Let this current pass for `dt_s`; heat is positive."""
        self.limiter.take(-current_a, dt_s)

    def current_a(self, duty: float, emf_v: float = 0.0) -> float:
        """Return the current into the module, heating the plate when positive.

        `emf_v` is the module's own voltage, positive when its plate is hotter than the sink.
        """
        cool_a, heat_a = self._most_a(emf_v)
        return min(max(self._wanted_a(duty), -cool_a), heat_a)

    def is_limiting(self, duty: float) -> bool:
        """Return whether the passive limiter reduces the current below the firmware's limits."""
        return not -BURST_LIMIT_A <= self._wanted_a(duty) <= HEAT_LIMIT_A

    def _wanted_a(self, duty: float) -> float:
        if not self.polarity:
            return 0.0
        return self.polarity * (self.shorted * math.inf if self.shorted else duty * FULL_SCALE_A)

    def _most_a(self, emf_v: float) -> tuple[float, float]:
        """Return the current limits of cooling and heating."""
        if self.is_ideal:
            return BURST_LIMIT_A, HEAT_LIMIT_A
        inner = MODULE_OHM + LEADS_OHM + SENSE_OHM + 2.0 * CHOKE_OHM
        inner += 0.0 if self.shorted else FETS_OHM
        heat_a = (SUPPLY_V - emf_v) / (inner + SERIES_OHM)
        cool_a = self.limiter.most_a(SUPPLY_V + emf_v, inner)
        return max(cool_a, 0.0), max(heat_a, 0.0)


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
