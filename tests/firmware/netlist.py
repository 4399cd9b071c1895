"""Computes the module's current from the nets of firmware/hardware/parts.py.

No formula of the circuit is repeated here: resistors, diode, module, plug and driver are connected
as their pins state, and Kirchhoff's law gives the currents. A part on the wrong net gets the
wrong current. Temperatures are not modelled.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Protocol

import numpy as np

from .hardware import (
    CHOKE_OHM,
    DIODE_OHM,
    DIODE_V,
    FETS_OHM,
    LEADS_OHM,
    MODULE_OHM,
    SUPPLY_V,
    Driver,
)

BOARD_V = 5.0
LEAK_OHM = 1e9  # between every net and the driver's second output, so that no net floats
RESISTORS, CHOKES = ("RS", "R13", "R14"), ("L1", "L2")


class Part(Protocol):
    """One part of parts.py."""

    name: str
    value: float | str
    pins: dict[str, str]


@dataclass(frozen=True)
class Flow:
    """The currents in ampere: into the module's plus lead, and through each part by its name."""

    module_a: float
    through_a: dict[str, float]


@dataclass(frozen=True)
class _Branch:
    """A resistor with a voltage in series, from net `one` to net `other`."""

    name: str
    one: str
    other: str
    ohm: float
    volts: float = 0.0


class Netlist:
    """The power stage of some parts; `turned` reverses the module's plug."""

    def __init__(self, parts: Sequence[Part], *, turned: bool = False) -> None:
        self._pins = {part.name: part.pins for part in parts}
        self._ohm = {part.name: part.value for part in parts if isinstance(part.value, float)}
        self._turned = turned

    def flow(self, duty: float, emf_v: float = 0.0) -> Flow:
        """Return the currents at a mean duty (heat positive) and a voltage of the module.

        The driver adjusts its output until the voltage over its sense pins equals what its control
        input demands, or saturates at its supply.
        """
        asked_v = self._control_v(duty) / 10.0
        wanted_v = min(max(asked_v, -self._limit_v("MAXIN")), self._limit_v("MAXIP"))
        low_v, high_v = -SUPPLY_V, SUPPLY_V
        for _ in range(24):
            middle_v = (low_v + high_v) / 2.0
            if self._sensed_v(middle_v, emf_v) < wanted_v:
                low_v = middle_v
            else:
                high_v = middle_v
        return self._currents(high_v, emf_v, FETS_OHM)

    def shorted(self, direction: int, emf_v: float = 0.0) -> Flow:
        """Return the currents with two shorted transistors of the bridge."""
        return self._currents(direction * SUPPLY_V, emf_v, 0.0)

    def _control_v(self, duty: float) -> float:
        """Return CTLI - REF: the operational amplifier brings its inputs to the same voltage."""
        heat_v, cool_v = max(duty, 0.0) * BOARD_V, max(-duty, 0.0) * BOARD_V
        levels = {self._pins["U1"]["D9"]: heat_v, self._pins["U1"]["D10"]: cool_v}
        plus, minus = self._pins["U2A"]["+"], self._pins["U2A"]["-"]
        reference, control = self._pins["U3"]["REF"], self._pins["U3"]["CTLI"]
        assert control in self._pins["R25"].values(), "the loop is closed behind this resistor"
        assert self._pins["U2A"]["out"] in self._pins["R25"].values()
        plus_v, _ = self._divided(plus, levels | {reference: 0.0})
        fed_v, share = self._divided(minus, levels | {control: 0.0})
        return (plus_v - fed_v) / share

    def _divided(self, net: str, levels: dict[str, float]) -> tuple[float, float]:
        """Return a net's voltage between its resistors' far ends, and the share of a zero end."""
        ends = [self._end(name, net, levels) for name in self._at(net)]
        siemens = sum(1.0 / ohm for _, ohm in ends)
        volts = sum(levels[end] / ohm for end, ohm in ends) / siemens
        held = [1.0 / ohm for end, ohm in ends if end not in self._board_nets()]
        return volts, sum(held) / siemens

    def _end(self, name: str, net: str, levels: dict[str, float]) -> tuple[str, float]:
        """Follow resistors from a net until one whose voltage is known."""
        other = next(it for it in self._pins[name].values() if it != net)
        ohm = float(self._ohm[name])
        if other in levels:
            return other, ohm
        onward = next(it for it in self._at(other) if it != name)
        end, more = self._end(onward, other, levels)
        return end, ohm + more

    def _at(self, net: str) -> list[str]:
        resistors = (name for name in self._ohm if name.startswith("R") and name != "RS")
        return [name for name in resistors if net in self._pins[name].values()]

    def _board_nets(self) -> tuple[str, str]:
        return self._pins["U1"]["D9"], self._pins["U1"]["D10"]

    def _limit_v(self, pin: str) -> float:
        """Return the sense voltage that a limit pin allows: its share of REF times 150 mV."""
        net, reference = self._pins["U3"][pin], self._pins["U3"]["REF"]
        share, _ = self._divided(net, {reference: 1.0, "GND": 0.0})
        return 0.15 * share

    def _sensed_v(self, output_v: float, emf_v: float) -> float:
        volts = self._solved(output_v, emf_v, FETS_OHM)[0]
        return volts[self._pins["U3"]["OS1"]] - volts[self._pins["U3"]["CS"]]

    def _currents(self, output_v: float, emf_v: float, fets_ohm: float) -> Flow:
        volts, branches = self._solved(output_v, emf_v, fets_ohm)
        through = {it.name: _current_a(it, volts) for it in branches}
        return Flow(through["TEC1"], through)

    def _solved(
        self, output_v: float, emf_v: float, fets_ohm: float
    ) -> tuple[dict[str, float], list[_Branch]]:
        """Return the net voltages with the diode blocking, unless it would then conduct.

        `output_v` is what the second output is above the first, so that more of it heats.
        """
        for conducts in (False, True):
            branches = self._branches(output_v, emf_v, fets_ohm, conducts=conducts)
            volts = _node_voltages(branches)
            if not conducts and self._forward_v(volts) <= DIODE_V:
                break
        return volts, branches

    def _forward_v(self, volts: dict[str, float]) -> float:
        return volts[self._pins["D1"]["A"]] - volts[self._pins["D1"]["K"]]

    def _branches(
        self, output_v: float, emf_v: float, fets_ohm: float, *, conducts: bool
    ) -> list[_Branch]:
        driver, diode, module = self._pins["U3"], self._pins["D1"], self._pins["TEC1"]
        plug = self._pins["J1"]
        ends = ("4", "3") if self._turned else ("3", "4")
        first, second = driver.get("LX1", driver["CS"]), driver.get("LX2", driver["OS2"])
        found = [
            _Branch("U3", first, second, fets_ohm + 1e-6, output_v),
            _Branch("J1", plug["1"], plug[ends[0]], LEADS_OHM / 2.0),
            _Branch("J1b", plug["2"], plug[ends[1]], LEADS_OHM / 2.0),
            _Branch("TEC1", module["+"], module["-"], MODULE_OHM, emf_v),
            *(self._between(it, float(self._ohm[it])) for it in RESISTORS),
            *(self._between(it, CHOKE_OHM) for it in CHOKES if it in self._pins),
        ]
        if conducts:
            found.append(_Branch("D1", diode["A"], diode["K"], DIODE_OHM, -DIODE_V))
        nets = {net for it in found for net in (it.one, it.other)} | set(diode.values())
        leaks = [_Branch(f"leak {a}", a, b, LEAK_OHM) for a, b in pairwise(sorted(nets))]
        return found + leaks

    def _between(self, name: str, ohm: float) -> _Branch:
        one, other = self._pins[name].values()
        return _Branch(name, one, other, ohm)


def _current_a(branch: _Branch, volts: dict[str, float]) -> float:
    """Return the current from `one` to `other` in the branch, driven by its `volts`."""
    return (volts[branch.one] - volts[branch.other] + branch.volts) / branch.ohm


def _node_voltages(branches: Sequence[_Branch]) -> dict[str, float]:
    """Solve Kirchhoff's law: currents sum to zero in every net but one, which is at zero volts."""
    nets = sorted({net for it in branches for net in (it.one, it.other)})
    place = {net: row for row, net in enumerate(nets)}
    matrix, right = np.zeros((len(nets), len(nets))), np.zeros(len(nets))
    for it in branches:
        one, other, siemens = place[it.one], place[it.other], 1.0 / it.ohm
        matrix[one, one] += siemens
        matrix[other, other] += siemens
        matrix[one, other] -= siemens
        matrix[other, one] -= siemens
        right[one] -= it.volts * siemens
        right[other] += it.volts * siemens
    matrix[0], right[0] = 0.0, 0.0
    matrix[0, 0] = 1.0
    volts = np.linalg.solve(matrix, right)
    return {net: float(volts[row]) for net, row in place.items()}


class DrawnDriver(Driver):
    """The driver of the closed loop, computed from the drawn circuit instead of formulas."""

    def __init__(self, netlist: Netlist) -> None:
        super().__init__()
        self._netlist = netlist

    def current_a(self, duty: float, emf_v: float = 0.0) -> float:
        """Return the current into the module, heating the plate when positive."""
        return -self._netlist.flow(duty, emf_v).module_a
