"""The table of faults: what fails, which guard must act, and its deadline.

A fault is injected into a running board. `sees_s` is the time until the fault has any effect;
its deadline counts from there. Each `sees_s` follows from the plant and the scene, not from
measurements of the firmware: nothing is driven before IDLE_S; a pair must differ by 1.5 degC; heat
at the limit of 1.8 A moves a plate by less than 7 degC/s.
"""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Literal

from hapticvlm.devices.simulated.plant import SINK_J_PER_K, Bead

from .board import RESET_BROWN_OUT, RESET_EXTERNAL, Board, Sensor, plate_mv, sink_mv
from .hardware import (
    CUT_OUT,
    CUT_OUT_BETA_K,
    OTHER_BETA_K,
    PLATE_A,
    PLATE_B,
    SINK,
    SUPPLY_MV,
    taken_for_c,
    thermistor_mv,
)
from .situations import COLD, COLD_WARM, HOT, Situation

ELECTRICAL_S = 0.15  # electrical and computing faults
HOST_S = 0.5  # silent host: the setpoint ends
WINDOW_S = 1.5  # implausible sensor: runaway window of 1 s, and the time to reach full drive
SLOW_S = 420.0  # slow heating or harmless faults: the only deadline is the skin's limits
IDLE_S = 2.6  # the host is silent for 0.6 s, then rests at neutral for 2 s

Guard = Literal["firmware", "current limit", "cut-out"]
BAG_BETA_K = 3380.0  # the next common type below 3950
HUM_MV = 100.0
IN_AIR_S = 5.0  # lag of a bead that is off, or half off
TIMSK0 = 0x6E  # TIMSK1 and TIMSK2 follow


@dataclass(frozen=True)
class Fault:
    """One fault; `numbers` are the firmware's names for it, any of which is correct.

    `guards` are what may catch it; none when the skin stays within its limits by itself. They must
    act in the situations of `acts_in`, in the others they may.
    `at_start` faults are there before the board is switched on; `silent` ends the host's messages.
    """

    name: str
    begin: Callable[[Board], None]
    numbers: tuple[str, ...] = ()
    guards: tuple[Guard, ...] = ("firmware",)
    deadline_s: float = ELECTRICAL_S
    sees_s: float = 0.0
    at_start: bool = False
    silent: bool = False
    noise: bool = False
    off_every_s: float = 0.0  # the host switches off and on with this period
    acts_in: tuple[Situation, ...] = (HOT, COLD, COLD_WARM)


def _volts(millivolts: float, *channels: int) -> Callable[[Board], None]:
    def begin(board: Board) -> None:
        for channel in channels:
            board.sensors[channel] = lambda _: millivolts

    return begin


def _frozen(*channels: int) -> Callable[[Board], None]:
    def begin(board: Board) -> None:
        for channel in channels:
            stands_at = board.sensors[channel](board)
            board.sensors[channel] = lambda _, mv=stands_at: mv  # type: ignore[misc]

    return begin


def _reads(true_c: Callable[[Board], float], offset_c: float, rate: float, since: float) -> Sensor:
    return lambda board: thermistor_mv(true_c(board) + offset_c + rate * (board.now - since))


def _wrong(offset_c: float, rate: float, *channels: int) -> Callable[[Board], None]:
    """Make the sensors read `offset_c` too high, plus a drift of `rate` degC/s."""

    def begin(board: Board) -> None:
        for channel in channels:
            board.sensors[channel] = _reads(_true_c(channel), offset_c, rate, board.now)

    return begin


def _true_c(channel: int) -> Callable[[Board], float]:
    if channel == SINK:
        return lambda board: board.plant.sink_c
    return lambda board: board.bead.c


def _other_beta(*channels: int) -> Callable[[Board], None]:
    def begin(board: Board) -> None:
        for channel in channels:
            true_c = _true_c(channel)
            board.sensors[channel] = lambda b, t=true_c: thermistor_mv(t(b), OTHER_BETA_K)  # type: ignore[misc]

    return begin


def _swapped(board: Board) -> None:
    board.sensors[PLATE_A], board.sensors[SINK] = sink_mv, plate_mv


def _loose(board: Board) -> None:
    """A contact that occasionally opens for 5 ms."""
    chance = random.Random(7)

    def sensor(board: Board) -> float:
        return SUPPLY_MV if chance.random() < 0.1 else plate_mv(board)

    board.sensors[PLATE_B] = sensor


def _no_tick(board: Board) -> None:
    for timer in range(3):
        board.poke(TIMSK0 + timer, 0)


def _hidden(then: Callable[[Board], None]) -> Callable[[Board], None]:
    def begin(board: Board) -> None:
        board.hide_reset_cause()
        then(board)

    return begin


def _polarity(board: Board) -> None:
    board.driver.polarity = -1


def _shorted(direction: int) -> Callable[[Board], None]:
    def begin(board: Board) -> None:
        board.driver.shorted = direction

    return begin


def _limiter(**changed: Any) -> Callable[[Board], None]:
    def begin(board: Board) -> None:
        board.driver.limiter = replace(board.driver.limiter, **changed)

    return begin


def _bead_off(board: Board) -> None:
    """The cut-out's bead hangs in the air beside the hand."""
    board.cut_out.bead = Bead(board.cut_out.bead.c, IN_AIR_S)
    board.cut_out.feels = lambda _: max(board.ambient_c, 20.0)


def _bead_slow(board: Board) -> None:
    board.cut_out.bead = Bead(board.cut_out.bead.c, IN_AIR_S)


def _comparator_stuck(board: Board) -> None:
    board.cut_out.is_stuck = True


def _leave_ignored(board: Board) -> None:
    board.cut_out.ignores_firmware = True


def _no_current(board: Board) -> None:
    board.driver.polarity = 0


def _sink(k_per_w: float, j_per_k: float = SINK_J_PER_K) -> Callable[[Board], None]:
    return lambda board: board.change_sink(k_per_w, j_per_k)


def _hum(hertz: float) -> Callable[[Board], None]:
    return lambda board: board.hum(HUM_MV, hertz)


def _shared_ground(ohm: float) -> Callable[[Board], None]:
    def begin(board: Board) -> None:
        board.shared_ground_ohm = ohm

    return begin


def _sense_grounded(board: Board) -> None:
    board.cut_out_wire = "grounded"


def _welded(board: Board) -> None:
    board.cut_out.is_welded = True


def _one_bag(board: Board) -> None:
    for channel in (PLATE_A, PLATE_B, SINK):
        true_c = _true_c(channel)
        board.sensors[channel] = lambda b, t=true_c: thermistor_mv(t(b), BAG_BETA_K)  # type: ignore[misc]


def one_bag_and_the_cut_out(board: Board) -> None:
    """The cut-out's bead is of the same wrong kind: what its own make and value prevent."""
    _one_bag(board)
    board.cut_out.reads = lambda true_c: taken_for_c(true_c, BAG_BETA_K, CUT_OUT_BETA_K)
    board.sensors[CUT_OUT] = lambda b: thermistor_mv(b.cut_out.bead.c, BAG_BETA_K)


def _nothing(board: Board) -> None:
    """Change nothing on the board: the fault is in the host or the line."""


BOTH = (PLATE_A, PLATE_B)
_LIES = ("RUNAWAY", "WIRED_BACKWARDS", "PLATE_FROZEN", "READING_JUMPS", "CUT_OUT_BEAD")
# Unnamed while the cut-out's bead is between both, as it is where the plate moves fast.
_A_LIES = ("PLATE_A_STRAYS", "READING_JUMPS", "PLATE_DISAGREES", "PLATE_FROZEN")
_B_LIES = ("PLATE_B_STRAYS", *_A_LIES[1:])
_LIES_TOO = (*_LIES, "CUT_OUT_OPEN")
_REBOOT = ("WATCHDOG", "RESTARTED_DRIVING")

# Parts of limiter and cut-out: the guards behind the firmware, most of which fail unseen.
PARTS = (
    Fault("D1 shorted", _limiter(diode_shorted=True), guards=(), deadline_s=SLOW_S, at_start=True),
    Fault("D1 open", _limiter(bypass_ohm=1e9), guards=(), deadline_s=SLOW_S, at_start=True),
    Fault("R13 shorted", _limiter(series_ohm=1e-3), guards=(), deadline_s=SLOW_S, at_start=True),
    Fault("R14 shorted", _limiter(bypass_ohm=1e-3), guards=(), deadline_s=SLOW_S, at_start=True),
    # Half-way to the air after 3.5 s: in the warm room at last by 10 degC.
    Fault("RT4 off", _bead_off, ("CUT_OUT_BEAD",), (), SLOW_S),
    Fault("RT4 slow", _bead_slow, ("CUT_OUT_BEAD",), (), SLOW_S, at_start=True),
    Fault("RT4's reading frozen", _frozen(CUT_OUT), ("CUT_OUT_BEAD",), (), SLOW_S),
    Fault("U4 open or Q1 shorted", _comparator_stuck, (), (), SLOW_S, at_start=True),
    Fault("Q2 shorted", _leave_ignored, ("CUT_OUT_UNTESTED",), sees_s=IDLE_S, at_start=True),
)

FAULTS = (
    Fault("plate A open", _volts(SUPPLY_MV, PLATE_A), ("PLATE_A_OPEN",)),
    Fault("plate A short", _volts(0.0, PLATE_A), ("PLATE_A_SHORT",)),
    Fault("plate B open", _volts(SUPPLY_MV, PLATE_B), ("PLATE_B_OPEN",)),
    Fault("plate B short", _volts(0.0, PLATE_B), ("PLATE_B_SHORT",)),
    Fault("plate B loose", _loose, ("PLATE_B_OPEN", "READING_JUMPS"), sees_s=0.3),
    Fault("sink open", _volts(SUPPLY_MV, SINK), ("SINK_OPEN",)),
    Fault("sink short", _volts(0.0, SINK), ("SINK_SHORT",)),
    # Shows when the working one has moved by 1.5 degC: at 1 to 2 degC/s.
    Fault("plate A frozen", _frozen(PLATE_A), _A_LIES, deadline_s=WINDOW_S, sees_s=1.5),
    Fault("plate B frozen", _frozen(PLATE_B), _B_LIES, deadline_s=WINDOW_S, sees_s=1.5),
    # 1.5 degC apart after 3 s.
    Fault("plate A drifts up", _wrong(0, 0.5, PLATE_A), _A_LIES, deadline_s=WINDOW_S, sees_s=3.0),
    Fault(
        "plate A drifts down", _wrong(0, -0.5, PLATE_A), _A_LIES, deadline_s=WINDOW_S, sees_s=3.0
    ),
    Fault("plate A jumps", _wrong(8, 0, PLATE_A), ("READING_JUMPS", "PLATE_A_STRAYS")),
    # At last they read as a short does.
    Fault(
        "plate A too fast",
        _wrong(0, 150, PLATE_A),
        ("READING_JUMPS", "PLATE_A_STRAYS", "PLATE_A_SHORT"),
    ),
    Fault(
        "sink too fast",
        _wrong(0, 150, SINK),
        ("READING_JUMPS", "SINK_HOT", "SINK_IMPLAUSIBLE", "SINK_SHORT"),
    ),
    # From a room of 15 degC to the trip at 44 in 2.5 s.
    Fault("sink reads too hot", _wrong(0, 12, SINK), ("SINK_HOT", "SINK_IMPLAUSIBLE"), sees_s=2.6),
    # The pair differs by 1.6 degC at 37 degC, which a working plate reaches 5.7 s after the start.
    Fault(
        "plate A wrong beta",
        _other_beta(PLATE_A),
        _A_LIES,
        deadline_s=WINDOW_S,
        sees_s=5.7,
        at_start=True,
        acts_in=(HOT,),
    ),
    # No wire is broken: two plausible readings disagree, which takes 0.3 s to be no noise. Hence
    # the class of implausible sensors, although nothing is driven yet.
    Fault("plate A swapped with sink", _swapped, _A_LIES, deadline_s=WINDOW_S, at_start=True),
    # A frozen sink reading is harmless by itself, because the plate's own guards do not need it.
    Fault("sink frozen", _frozen(SINK), ("SINK_IMPLAUSIBLE",), (), SLOW_S),
    Fault("both frozen alike", _frozen(*BOTH), _LIES, deadline_s=WINDOW_S, sees_s=1.5),
    # Each burst is too short for the window of a second; their energy counts together.
    Fault(
        "both frozen, host off and on",
        _frozen(*BOTH),
        _LIES,
        deadline_s=SLOW_S,
        off_every_s=0.3,
    ),
    Fault(
        "both wrong beta",
        _other_beta(*BOTH),
        (),
        ("firmware", "cut-out"),
        SLOW_S,
        at_start=True,
        acts_in=(HOT,),
    ),
    # Plate and sink of one wrong bag; the cut-out's bead is of another make, value and beta.
    Fault(
        "all beads of one wrong kind",
        _one_bag,
        (),
        ("firmware", "cut-out"),
        SLOW_S,
        at_start=True,
        acts_in=(HOT,),
    ),
    # A sensor pair that lies alike from the start is beyond any program, but where the plate cannot
    # follow any further: the cut-out is for these.
    Fault(
        "both read 8 low",
        _wrong(-8, 0, *BOTH),
        (),
        ("firmware", "cut-out"),
        SLOW_S,
        at_start=True,
        acts_in=(HOT,),
    ),
    Fault(
        "both read 8 high",
        _wrong(8, 0, *BOTH),
        (),
        ("firmware", "cut-out"),
        SLOW_S,
        at_start=True,
        acts_in=(COLD, COLD_WARM),
    ),
    # A pair that drifts alike is a plate that follows; when it shows depends on room and setpoint.
    Fault("both drift down", _wrong(0, -0.5, *BOTH), _LIES_TOO, ("firmware", "cut-out"), SLOW_S),
    Fault("both drift up", _wrong(0, 0.5, *BOTH), _LIES_TOO, ("firmware", "cut-out"), SLOW_S),
    # 12 degC/s to the plate's trips, against a loop that cools by up to 5 degC/s or heats by 2.
    Fault(
        "both read too hot",
        _wrong(0, 12, *BOTH),
        ("OVER_TEMPERATURE", "DOSE_SPENT", *_LIES),
        sees_s=2.5,
    ),
    Fault(
        "both read too cold",
        _wrong(0, -12, *BOTH),
        (("UNDER_TEMPERATURE", *_LIES)),
        sees_s=2.5,
    ),
    # Shows once it is driven. Resting at neutral it drifts, by chance of the noise, up or down;
    # where that is the way it is then asked to go, it shows 0.5 s later. In cold it takes up to
    # 2.8 s, as what should cool heats with 0.75 A, less than 2 degC/s: judged by its 15 J.
    Fault(
        "module backwards",
        _polarity,
        ("WIRED_BACKWARDS", "RUNAWAY"),
        deadline_s=WINDOW_S,
        sees_s=IDLE_S + 1.3,
        at_start=True,
    ),
    # Without current it is harmless; it shows once the plate should change faster than the room.
    # In a room of 15 degC the plate cools by itself nearly as fast as it should: 14 s.
    Fault("no current", _no_current, ("RUNAWAY",), deadline_s=SLOW_S),
    Fault("sink 5 K/W", _sink(5.0), ("COOLING_REVERSED", "SINK_HOT"), (), SLOW_S, at_start=True),
    Fault("sink 8 K/W", _sink(8.0), ("COOLING_REVERSED", "SINK_HOT"), (), SLOW_S, at_start=True),
    Fault(
        "fan dead, heavy sink",
        _sink(10.0, 300.0),
        ("COOLING_REVERSED", "SINK_HOT"),
        (),
        SLOW_S,
    ),
    Fault("fan dead", _sink(10.0), ("COOLING_REVERSED", "SINK_HOT"), (), SLOW_S),
    Fault("host silent", _nothing, guards=("firmware",), deadline_s=HOST_S, silent=True),
    Fault("line noise", _nothing, guards=(), noise=True),
    Fault("hang, interrupts on", lambda board: board.hang(interrupts=True), _REBOOT),
    Fault("hang, interrupts off", lambda board: board.hang(interrupts=False), _REBOOT),
    Fault("dead tick", _no_tick, _REBOOT),
    Fault(
        "brown-out", lambda board: board.reset(RESET_BROWN_OUT), ("BROWN_OUT", "RESTARTED_DRIVING")
    ),
    Fault("reset by the port", lambda board: board.reset(RESET_EXTERNAL), ("RESTARTED_DRIVING",)),
    Fault(
        "hang, boot loader hides it", _hidden(lambda board: board.hang(interrupts=True)), _REBOOT
    ),
    Fault(
        "brown-out, boot loader hides it",
        _hidden(lambda board: board.reset(0)),
        ("RESTARTED_DRIVING",),
    ),
    Fault("hum of 50 Hz", _hum(50.0), guards=(), deadline_s=SLOW_S),
    Fault("hum of 60 Hz", _hum(60.0), guards=(), deadline_s=SLOW_S),
    # 3 A through 20 mohm are 60 mV, 1.2 degC; through 50 mohm the first turn of the current jumps.
    Fault("shared ground of 20 mohm", _shared_ground(0.02), guards=(), deadline_s=SLOW_S),
    Fault(
        "shared ground of 50 mohm",
        _shared_ground(0.05),
        ("READING_JUMPS", "WIRED_BACKWARDS", "RUNAWAY"),
        guards=(),
        deadline_s=SLOW_S,
    ),
    Fault("sense wire of the cut-out grounded", _sense_grounded, ("CUT_OUT_OPEN",)),
    # Found before anything is driven: its break contact was never closed since the power came.
    Fault("cut-out welded", _welded, ("CUT_OUT_UNTESTED",), sees_s=IDLE_S, at_start=True),
    *PARTS,
    Fault("bridge shorted to heat", _shorted(1), guards=("current limit", "cut-out")),
    Fault("bridge shorted to cool", _shorted(-1), guards=("current limit", "cut-out")),
)
BY_NAME = {fault.name: fault for fault in FAULTS}
