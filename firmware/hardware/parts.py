"""The parts of the plate's circuit, their values, and the net at each pin.

This is the only source of them: `circuit.py` draws them and writes wiring.md, and a test computes
from them the values that the firmware and its simulation assume. It contains no drawing code.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

BOARD = {
    "D6": "PERMIT",
    "D7": "SENSE",
    "D8": "ENABLE",
    "D9": "HEAT",
    "D10": "COOL",
    "A0": "A0",
    "A1": "A1",
}


@dataclass(frozen=True, slots=True)
class Part:
    """One part; `value` is in ohm, farad or volt where it is a number."""

    name: str
    value: float | str
    what: str
    pins: dict[str, str]


def _two(name: str, value: float | str, what: str, one: str, other: str) -> Part:
    return Part(name, value, what, {"1": one, "2": other})


MOSFET = "logic-level MOSFET: drops millivolts at 0.14 A"

PARTS = (
    # Board and its thermistors
    Part(
        "U1",
        "Uno or Nano",
        "ATmega328P, 16 MHz, optiboot",
        BOARD | {"A2": "A2", "A3": "A3", "5V": "BOARD5V", "GND": "GND"},
    ),
    _two("RT1", 10e3, "NTC, beta 3950, 1 %, on the face", "A0", "GND"),
    _two("RT2", 10e3, "NTC, beta 3950, 1 %, on the face, wires of its own", "A1", "GND"),
    _two("RT3", 10e3, "NTC, beta 3950, 1 %, on the sink", "A2", "GND"),
    _two("R1", 10e3, "0.1 %", "BOARD5V", "A0"),
    _two("R2", 10e3, "0.1 %", "BOARD5V", "A1"),
    _two("R3", 10e3, "0.1 %", "BOARD5V", "A2"),
    _two("C1", 100e-9, "ceramic", "A0", "GND"),
    _two("C2", 100e-9, "ceramic", "A1", "GND"),
    _two("C3", 100e-9, "ceramic", "A2", "GND"),
    _two("R4", 10e3, "pull-down", "HEAT", "GND"),
    _two("R5", 10e3, "pull-down", "COOL", "GND"),
    _two("R6", 10e3, "pull-down", "ENABLE", "GND"),
    _two("R24", 10e3, "protects a driver without supply", "ENABLE", "SHDN"),
    # From two duties to one control voltage: REF + 0.30 (heat - cool), 64 Hz
    _two("R7", 49.9e3, "1 %", "HEAT", "H1"),
    _two("R8", 49.9e3, "1 %", "H1", "PLUS"),
    _two("C4", 100e-9, "ceramic", "H1", "GND"),
    _two("R11", 30.1e3, "1 %", "PLUS", "REF"),
    _two("R9", 49.9e3, "1 %", "COOL", "H2"),
    _two("R10", 49.9e3, "1 %", "H2", "MINUS"),
    _two("C5", 100e-9, "ceramic", "H2", "GND"),
    _two("R12", 30.1e3, "1 %", "MINUS", "CTLI"),
    Part(
        "U2A",
        "MCP6002",
        "half of a rail-to-rail operational amplifier, or similar",
        {"+": "PLUS", "-": "MINUS", "out": "DRIVE", "V+": "BOARD5V", "V-": "GND"},
    ),
    _two("R25", 10e3, "protects a driver without supply", "DRIVE", "CTLI"),
    _two("C7", 100e-9, "ceramic, at U2", "BOARD5V", "GND"),
    # Driver, and the limiter that works whatever the driver does. The driver holds
    # V(OS1) - V(CS) = RS I at (CTLI - REF) / 10, so all parts that carry the module's current
    # are between OS1 and OS2, and RS alone is between OS1 and CS, behind the choke L1.
    # CTLI above REF makes V(OS2) > V(OS1) > V(CS): the current enters the module at its minus
    # lead and leaves at its plus lead, which heats the face whose makers call it the cold one.
    Part(
        "U3",
        "MAX1968",
        "current-controlled TEC driver, +-3 A, on its evaluation kit",
        {
            "VDD": "SW",
            "GND": "GND",
            "CTLI": "CTLI",
            "REF": "REF",
            "SHDN": "SHDN",
            "MAXIP": "MAXIP",
            "MAXIN": "MAXIN",
            "MAXV": "REF",
            "LX1": "LX1",
            "CS": "CS",
            "OS1": "OS1",
            "LX2": "LX2",
            "OS2": "OS2",
        },
    ),
    _two("L1", "choke 1", "on the kit; 3 uH, 5 A, at most 0.05 ohm", "LX1", "CS"),
    _two("RS", 0.05, "on the kit; the driver's sense resistor, 1 %, 1 W", "CS", "OS1"),
    _two("L2", "choke 2", "on the kit; 3 uH, 5 A, at most 0.05 ohm", "LX2", "OS2"),
    _two("R20", 6.65e3, "1 %, limit of the heating current", "REF", "MAXIP"),
    _two("R21", 10.0e3, "1 %", "MAXIP", "GND"),
    _two("R22", 1.0e3, "1 %, limit of the cooling current", "REF", "MAXIN"),
    _two("R23", 100.0e3, "1 %", "MAXIN", "GND"),
    Part("J1", "plug", "between driver and module", {"1": "OS1", "2": "OS2", "3": "M1", "4": "M2"}),
    _two("R13", 2.0, "25 W in an aluminium case, on a plate of its own", "M1", "TEC+"),
    Part("D1", "SB340", "Schottky, 3 A: conducts while cooling", {"A": "M1", "K": "D1K"}),
    _two("R14", 1.36, "25 W in an aluminium case, beside R13", "D1K", "TEC+"),
    Part("TEC1", "TEC1-03108", "31 couples, 20 x 20 mm, 0.37 ohm", {"+": "TEC+", "-": "M2"}),
    # Cut-out: window comparator, relay that holds itself while the comparator and the board let it.
    # The board's supply feeds the thermistor and all that compares it, so that the board reads it
    # as it reads the others, and an unplugged board opens the relay. The follower lets the board
    # read without a way back: no program can move the comparator's thresholds.
    Part(
        "J2", 5.0, "supply of the module, 4 A or more, not the board's", {"+": "FUSED", "-": "GND"}
    ),
    _two("F1", "4 A", "fuse, slow", "FUSED", "+5V"),
    _two("RT4", 100e3, "NTC, beta 4267, 1 %, of another maker, on the face", "BEAD", "GND"),
    _two("R15", 100e3, "0.1 %", "BOARD5V", "BEAD"),
    _two("C6", 100e-9, "ceramic", "BEAD", "GND"),
    Part("U2B", "MCP6002", "the other half", {"+": "BEAD", "-": "A3", "out": "A3"}),
    _two("R16", 29.1e3, "0.1 %", "BOARD5V", "COLD"),
    _two("R17", 20.0e3, "0.1 %", "COLD", "HOT"),
    _two("R18", 23.2e3, "0.1 %", "HOT", "GND"),
    Part(
        "U4A",
        "TLC393",
        "half of a CMOS comparator, open drain",
        {"+": "BEAD", "-": "HOT", "out": "GOOD", "V+": "BOARD5V", "V-": "GND"},
    ),
    Part("U4B", "TLC393", "the other half", {"+": "COLD", "-": "BEAD", "out": "GOOD"}),
    _two("C8", 100e-9, "ceramic, at U4", "BOARD5V", "GND"),
    _two("R19", 10e3, "pull-up", "BOARD5V", "GOOD"),
    Part("Q1", "IRLZ44N", MOSFET, {"G": "GOOD", "D": "COIL-", "S": "LEAVE"}),
    Part("Q2", "IRLZ44N", MOSFET, {"G": "PERMIT", "D": "LEAVE", "S": "GND"}),
    _two("R26", 10e3, "pull-down", "PERMIT", "GND"),
    Part(
        "K1",
        "5 V relay",
        "force-guided (EN 61810-3), 5 A: make contact 11-14 switches, break contact 21-22 reports",
        {"coil+": "COIL+", "coil-": "COIL-", "11": "+5V", "14": "SW", "21": "SENSE", "22": "GND"},
    ),
    Part("D2", "1N4001", "holds the relay by its own contact", {"A": "SW", "K": "COIL+"}),
    Part("D3", "1N4001", "across the coil", {"A": "COIL-", "K": "COIL+"}),
    _two("S1", "push-button", "starts the cut-out", "+5V", "COIL+"),
    _two("S2", "push-button", "tests the cut-out: it must open", "GOOD", "GND"),
)
BY_NAME = {part.name: part for part in PARTS}

# The plate of one resistor (../ONE_RESISTOR.md): the board pulses a bridge, R13 alone limits its
# current, and the relay of the cut-out holds by the board's leave alone. Without a comparator the
# board may read RT4 directly. Signs as above: HEAT drives OUT2 high, the module's minus lead.
_SHARED = "U1 RT1 RT2 RT3 R1 R2 R3 C1 C2 C3 R6 D2 D3 S1 R26"
ONE_RESISTOR = (
    *(BY_NAME[name] for name in _SHARED.split()),
    Part(
        "U3",
        "DRV8833",
        "bridge on a board of its own: 2.7 to 10.8 V, pulsed through IN1 and IN2",
        {
            "VM": "SW",
            "GND": "GND",
            "IN1": "COOL",
            "IN2": "HEAT",
            "EEP": "ENABLE",
            "OUT1": "OUT1",
            "OUT2": "M2",
        },
    ),
    _two("R13", 6.2, "10 W, 5 %, wire-wound in an aluminium case", "OUT1", "TEC+"),
    BY_NAME["TEC1"],
    Part("J2", 5.0, "supply of the module, 2 A, not the board's", {"+": "FUSED", "-": "GND"}),
    _two("F1", "1.25 A", "fuse, slow", "FUSED", "+5V"),
    _two("RT4", 100e3, BY_NAME["RT4"].what, "A3", "GND"),
    _two("R15", 100e3, "0.1 %", "BOARD5V", "A3"),
    _two("C6", 100e-9, "ceramic", "A3", "GND"),
    Part("Q2", "IRLZ44N", MOSFET, {"G": "PERMIT", "D": "COIL-", "S": "GND"}),
    BY_NAME["K1"],
)
SINK_EUR = 12.0  # 1 to 3 K/W, with a fan
# Estimates of November 2026; no shop was asked. Pieces of one kind cost the same. U3 of the full
# plate is its kit (no price was found: 100 to 150 is a guess), with L1, L2 and RS. U2B and U4B come
# with U2A and U4A, and R13 with the plate of aluminium under it.
_KINDS = "U1 12 TEC1 10 F1 1.5 RT4 1.5 K1 12 Q 1 S .5 RT 1 R .4 C .1 D .1 "
_ONE_RESISTOR = _KINDS + "U3 4 R13 3 J2 8"
_FULL = _KINDS + "U3 125 R13 10 R14 5 D1 .5 J1 2 J2 15 U2A 1 U4A 1.5 U2B 0 U4B 0 L 0 RS 0"

# The driver is bought as its evaluation kit, because the chip needs a compensated loop and short
# power traces. These pins of the chip are wired on the kit alone. Its pins are from a public symbol
# library; the kit's own schematic could not be read, so that its part numbers are missing here.
ON_KIT = {
    "PVDD": "power supply, with the kit's capacitors: feed it and VDD from SW",
    "PGND": "power ground: join it to GND at the kit",
    "COMP": "capacitor that compensates the current loop: leave it",
    "FREQ": "switching frequency: leave it at 500 kHz",
    "ITEC": "monitor of the current: may stay open",
}
KIT_STEPS = (
    "Find each pin on the kit's schematic and, with an ohmmeter, at the chip. Then remove parts.",
    "Leave chokes, sense resistor and capacitors. L1, L2 and RS exist once, on the kit.",
    "Remove what sets the control voltage, such as a potentiometer: R25 alone feeds CTLI.",
    "Remove the kit's resistors at MAXIP, MAXIN and MAXV. Solder R20 to R23 to the pads of the"
    " first two, and a wire from MAXV to REF.",
    "Remove the jumper that ties SHDN high. Solder R24 there; R6 must pull it low.",
    "Solder a wire to REF for R11. Solder the supply from SW and GND to the kit's supply pads.",
    "Solder J1 to OS1 and OS2, behind the kit's filter capacitors, never to LX1, LX2 or CS.",
    "Before the module: measure MAXIP 0.60 and MAXIN 0.99 of REF, and CTLI equal to REF at duty 0.",
)

# Ratings from data sheets or the type of part: W for resistors, A and V for the others.
POWER_W = {"RS": 1.0, "R13": 25.0, "R14": 25.0}
SMALL_POWER_W = 0.1
CURRENT_A = {"D1": 3.0, "K1": 5.0, "F1": 4.0, "J1": 5.0, "L1": 5.0, "L2": 5.0, "TEC1": 8.0}
REVERSE_V = {"D1": 40.0, "D2": 50.0, "D3": 50.0}
# R13 and R14 dissipate up to 10 W together. They are screwed with thermal paste to their own
# aluminium plate, 150 x 100 x 2 mm, upright in free air [assumption: 3.5 K/W], a hand's length from
# the palm, behind a cover with holes. They must not be on the module's sink, which they would warm.
RESISTORS_K_PER_W = 3.5
TOUCHABLE_C = 70.0  # bare metal for a second (docs/physics.md 3.1)
BEAD_BETA_K = 4267.0


def price_eur(name: str, *, has_one_resistor: bool) -> float:
    """Return the price of a part of one of the two plates."""
    words = (_ONE_RESISTOR if has_one_resistor else _FULL).split()
    prices = dict(zip(words[::2], map(float, words[1::2]), strict=True))
    return prices[name if name in prices else name.rstrip("0123456789")]


def number(name: str) -> float:
    """Return the value of a part that is a number."""
    value = BY_NAME[name].value
    if isinstance(value, str):
        raise TypeError(f"{name} is {value}")
    return value


def cut_out_c() -> tuple[float, float]:
    """Return the temperatures at which the window comparator opens, cold and hot, in degC."""
    ladder = number("R16") + number("R17") + number("R18")
    hot, cold = number("R18") / ladder, (number("R17") + number("R18")) / ladder
    return _bead_c(cold), _bead_c(hot)


def _bead_c(ratio: float) -> float:
    ohm = number("R15") * ratio / (1.0 - ratio)
    return 1.0 / (1.0 / 298.15 + math.log(ohm / number("RT4")) / BEAD_BETA_K) - 273.15


def driver_limits_a() -> tuple[float, float]:
    """Return the limits of cooling and heating that MAXIN and MAXIP set in a working driver.

    A limit is the pin's share of REF times 150 mV / RS.
    """
    most_a = 0.15 / number("RS")
    heat, cool = (
        number(low) / (number(high) + number(low)) for high, low in (("R20", "R21"), ("R22", "R23"))
    )
    return cool * most_a, heat * most_a


def full_scale_a(board_v: float = 5.0) -> float:
    """Return the module current at full duty: the driver gives (CTLI - REF) / (10 RS)."""
    gain = number("R12") / (number("R9") + number("R10"))
    return board_v * gain / (10.0 * number("RS"))
