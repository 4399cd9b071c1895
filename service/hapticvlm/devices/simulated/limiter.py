"""Simulates the passive limiter of a plate's current, and the store that lets cooling begin faster.

The limiter is on the module's leads, so that it works whatever driver and firmware do
(firmware/hardware/wiring.md). Heat passes R13 alone. Cold passes R13 and, beside it, a diode with
R14 behind it. The store is a capacitor across R14. Empty it bridges R14, full it passes nothing.
So cooling begins with a larger current, and what is added is bounded by the charge that the store
holds. R14 empties it again within a second or two.

All currents and voltages here are those of cooling; the diode blocks while the module is heated.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

SERIES_OHM, BYPASS_OHM, DIODE_V = 6.2, 2.0, 0.45  # R13, R14, D1
CELLS, CELL_FARAD, CELL_OHM = 3, 0.76, 0.05  # C9 to C11 in series
STORE_FARAD, STORE_OHM = CELL_FARAD / CELLS, CELL_OHM * CELLS
_STEP_V = 1e-3  # for a slope of what is piecewise linear


@dataclass
class Limiter:
    """The limiter with its store, of a capacitance and a series resistance; `volts` is its charge.

    Without a store (`farad` 0) it is the limiter of a plate that was built before there was one.
    A store of infinite capacitance never fills, like a shorted one.
    """

    farad: float = STORE_FARAD
    store_ohm: float = STORE_OHM
    volts: float = 0.0

    def most_a(self, source_v: float, inner_ohm: float) -> float:
        """Return the current that a voltage behind a resistance drives through the limiter."""
        drop_v = self._drop_v(source_v / inner_ohm, 1.0 / inner_ohm, self.volts)
        return (source_v - drop_v) / inner_ohm

    def take(self, current_a: float, dt_s: float) -> None:
        """Let a constant current pass for `dt_s`, exactly; a negative one heats."""
        if not self.farad:
            return
        # The charge approaches its end exponentially, because between the diode's two states the
        # current into the store falls in proportion to its voltage.
        into_a = self._into_a(current_a, self.volts)
        siemens = (into_a - self._into_a(current_a, self.volts + _STEP_V)) / _STEP_V
        share = -math.expm1(-siemens * dt_s / self.farad)
        self.volts = max(self.volts + into_a / siemens * share, 0.0)

    def _drop_v(self, fed_a: float, siemens: float, volts: float) -> float:
        """Return the voltage over the limiter beside a source of a current and a conductance."""
        siemens += 1.0 / SERIES_OHM
        store = 1.0 / self.store_ohm if self.farad else 0.0
        behind = 1.0 / BYPASS_OHM + store
        idle_v = volts * store / behind
        blocked_v = fed_a / siemens
        if blocked_v <= DIODE_V + idle_v:
            return blocked_v
        return (fed_a + (DIODE_V + idle_v) * behind) / (siemens + behind)

    def _into_a(self, current_a: float, volts: float) -> float:
        """Return the current into a store of this voltage."""
        drop_v = self._drop_v(max(current_a, 0.0), 0.0, volts)
        idle_v = volts * BYPASS_OHM / (BYPASS_OHM + self.store_ohm)
        return (max(drop_v - DIODE_V, idle_v) - volts) / self.store_ohm
