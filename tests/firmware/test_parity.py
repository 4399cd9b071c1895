"""Compares the simulated board with the compiled firmware: same bytes, same answers; same
scene, same current. The guards of sensors and drive, which the simulation lacks, are not compared.
"""

from __future__ import annotations

import math

import pytest

from hapticvlm.devices.plate.framing import Deframer
from hapticvlm.devices.simulated.plant import PALM_RESISTANCE
from hapticvlm.devices.simulated.simulated import SimulatedPlate
from hapticvlm.devices.simulated.simulated_board import SimulatedBoard

from . import line
from .board import STARTED_S, Board
from .build import Chip
from .hardware import FULL_SCALE_A
from .line import CLEAR, HELLO, OFF, REST, SETPOINT
from .rawhost import RawHost

OURS, OTHERS = b"\x01\x00", b"\x02\x00"
WARM, COOL = line.setpoint(34.0, 1.0), line.setpoint(28.0, 1.0)
TURN_S = 0.05
WORDS: list[tuple[int, bytes]] = [
    (SETPOINT, WARM),  # before a HELLO
    (CLEAR, b"\x01"),
    (REST, b""),
    (OFF, b""),
    (HELLO, OTHERS),
    (SETPOINT, WARM),
    (HELLO, b"\x01\x63"),
    (SETPOINT, WARM),
    (SETPOINT, line.setpoint(17.999)),
    (SETPOINT, line.setpoint(40.001)),
    (SETPOINT, line.setpoint(32.0, 0.0)),
    (SETPOINT, line.setpoint(32.0, 1.001)),
    (SETPOINT, WARM),
    (SETPOINT, WARM[:-1]),
    (HELLO, b"\x01"),
    (0x55, b""),
    (0x81, bytes(31)),
    (CLEAR, b"\x01"),
    (CLEAR, b"\xff"),
    (SETPOINT, COOL),
    (HELLO, OTHERS),  # while it holds: the bridge opens
    (SETPOINT, COOL),
    (REST, b""),
    (HELLO, OURS),
    *[(SETPOINT, COOL)] * 12,
    (REST, b""),
    (REST, b""),
    (HELLO, OTHERS),  # while it returns
    (HELLO, OURS),
    *[(SETPOINT, COOL)] * 3,
    (REST, b""),
    (OFF, b""),
    (SETPOINT, COOL),
    (OFF, b"\x00"),
]


class Simulated:
    """A simulated board whose bytes are decoded like the chip's."""

    def __init__(self) -> None:
        self.board = SimulatedBoard()
        self.now = 0.0
        self.acks: list[tuple[int, int, str]] = []
        self.state = "off"
        self._deframer = Deframer()

    def hear(self, wire: bytes) -> None:
        """Send bytes and advance by one turn."""
        received = b""
        for step in range(10):
            self.now += TURN_S / 10.0
            received += self.board.exchange(wire if step == 0 else b"", self.now)
        for said in map(line.said, self._deframer.feed(received)):
            match said:
                case line.Telemetry(state=state):
                    self.state = state
                case (of, seq, answer):
                    self.acks.append((of, seq, answer))
        assert self._deframer.bad == 0


def test_the_simulated_board_answers_the_same_bytes_as_the_firmware(board: Board) -> None:
    host, simulated = RawHost(board), Simulated()
    host.advance(0.6)
    states: list[str] = []
    for seq, (type, payload) in enumerate(WORDS):
        wire = line.frame(type, seq, payload)
        board.write(wire)
        host.telemetry = None
        host.advance(2 * TURN_S)
        simulated.hear(wire)
        simulated.hear(b"")
        assert host.telemetry is not None
        states.append(f"{seq}: {host.telemetry.state}")
        assert states[-1] == f"{seq}: {simulated.state}"

    assert simulated.acks == host.acks
    assert len(host.acks) == len(WORDS)
    assert {state.split()[1] for state in states} == {"off", "holding", "returning"}


def asked_c(elapsed_s: float) -> float:
    """Return the setpoint: rest, the coldest, then warmer again."""
    if elapsed_s < 1.0:
        return 32.0
    return 18.0 if elapsed_s < 12.0 else 36.0


@pytest.mark.parametrize(("room_c", "sink_c"), [(23.0, 23.0), (30.0, 43.0)])
def test_the_simulated_plate_is_driven_like_the_firmware_drives_it(
    chip: Chip, room_c: float, sink_c: float
) -> None:
    board = chip.board(room_c)
    board.plant._state_c[0] = sink_c
    board.driver.is_ideal = True
    plate = SimulatedPlate(room_c, palm_resistance=PALM_RESISTANCE)
    plate._plant._state_c[0] = sink_c
    host = RawHost(board)
    host.greet()
    plate.advance(STARTED_S)
    plate.advance(board.now)  # both have cooled alike, with nothing driven
    began_s = board.now
    apart_a, apart_c = [], []
    for turn in range(round(16.0 / TURN_S)):
        wanted_c, now = asked_c(turn * TURN_S), began_s + turn * TURN_S
        host.send(SETPOINT, line.setpoint(wanted_c))
        host.advance(TURN_S)
        plate.command(wanted_c, 0.25, now)
        plate.advance(now + TURN_S)
        apart_a.append(board.driver.current_a(board.duty) - plate.current_a)
        apart_c.append(abs(board.plant.plate_c - plate._plant.plate_c))
    board.close()

    rms_a = math.sqrt(sum(a * a for a in apart_a) / len(apart_a))
    # 4 % of full duty: noise at the limit, test pulses, and the firmware's feed-forward of cooling,
    # which the simulated plate applies a step later; its effect on the skin is bounded below.
    assert rms_a < 0.05 * FULL_SCALE_A
    assert max(apart_c) < 0.35
