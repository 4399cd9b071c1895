"""Tests `Peltier` on a simulated board behind a port, in lock-step and with its thread."""

from __future__ import annotations

import json
import os
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace

import pytest
from pace import PACE, until
from plate_ports import TURN_S, Cable

from hapticvlm.commands.main import main
from hapticvlm.devices.errors import DeviceError
from hapticvlm.devices.plate import ports
from hapticvlm.devices.plate import protocol as plate_protocol
from hapticvlm.devices.plate.framing import Deframer
from hapticvlm.devices.plate.peltier import Peltier
from hapticvlm.devices.plate.plate import Plate
from hapticvlm.devices.simulated.plant import Plant
from hapticvlm.devices.simulated.simulated import SimulatedPlate
from hapticvlm.devices.simulated.simulated_board import (
    SimulatedBoard,
    SimulatedPort,
    simulated_plate,
)
from hapticvlm.processes.priority import request_priority
from hapticvlm.rendering.heat.limits import PlateReading

READ_S = 0.02


def hold(cable: Cable, plate: Peltier, setpoint_c: float, seconds: float) -> list[PlateReading]:
    """Command and poll as gateway and thread do, in lock-step; return every reading."""
    readings = []
    ends = cable.clock.now + seconds
    while cable.clock.now < ends:
        plate.command(setpoint_c, 0.25, cable.clock.now)
        plate.poll()
        readings.append(plate.advance(cable.clock.now))
    return readings


def leave(cable: Cable, plate: Peltier, seconds: float) -> list[PlateReading]:
    """Poll without commanding; return every reading."""
    readings = []
    ends = cable.clock.now + seconds
    while cable.clock.now < ends:
        plate.poll()
        readings.append(plate.advance(cable.clock.now))
    return readings


def test_the_line_changes_nothing_that_the_plate_does() -> None:
    cable, bare = Cable(), SimulatedPlate()
    plate = cable.plate()
    over_the_line = hold(cable, plate, 24.0, 6.0)[-1]
    assert not any(plate.counts.values())
    for tick in range(round(6.0 / TURN_S)):
        bare.command(24.0, 0.25, tick * TURN_S)
        at_hand = bare.advance((tick + 1) * TURN_S)

    assert over_the_line.plate_c == pytest.approx(at_hand.plate_c, abs=0.1)
    assert over_the_line.duty == pytest.approx(at_hand.duty, abs=0.05)


def test_the_plate_says_what_it_is() -> None:
    cable = Cable()
    plate = cable.plate()

    assert plate.name == "plate on cable, firmware 0.0.0, board 0"
    assert not plate.simulated
    assert simulated_plate().name == "simulated plate"
    assert simulated_plate().simulated


def test_both_plates_are_plates() -> None:
    plates: list[Plate] = [simulated_plate(), SimulatedPlate()]

    assert all(plate.simulated for plate in plates)


def test_a_silent_host_is_returned_to_neutral_by_the_board() -> None:
    cable = Cable()
    plate = cable.plate()
    hold(cable, plate, 22.0, 5.0)
    readings = leave(cable, plate, 15.0)

    assert readings[-1].duty == 0.0
    assert max(reading.setpoint_c for reading in readings) == pytest.approx(32.0, abs=0.1)


def test_rest_reaches_the_board() -> None:
    cable = Cable()
    plate = cable.plate()
    hold(cable, plate, 38.0, 5.0)
    plate.rest(cable.clock.now)
    leave(cable, plate, 0.1)

    assert plate_protocol.Rest() in cable.sent
    assert cable.board.plate.state is plate_protocol.State.RETURNING


def test_close_switches_the_board_off_at_once() -> None:
    cable = Cable()
    plate = cable.plate()
    hold(cable, plate, 38.0, 2.0)
    plate.close()
    plate.close()

    assert cable.sent[-1] == plate_protocol.Off()
    assert cable.board.plate.state is plate_protocol.State.OFF
    assert plate.advance(cable.clock.now).faults == ()


def test_a_port_that_says_nothing_is_no_plate() -> None:
    cable = Cable()
    cable.is_mute = True
    begin = cable.clock.now

    with pytest.raises(DeviceError, match="no plate answered; cable: "):
        cable.plate()
    assert cable.clock.now - begin <= 8.0 + 1.0


def test_a_port_full_of_garbage_is_no_plate() -> None:
    cable = Cable()
    cable.is_mute, cable.noise = True, b"garbage\0" * 20

    with pytest.raises(DeviceError, match="no plate answered"):
        cable.plate()


def test_a_port_that_cannot_be_opened_is_named_with_the_reason() -> None:
    with pytest.raises(DeviceError, match="no-such-port: can't be opened: No such file"):
        Peltier("no-such-port").connect()


def test_an_unplugged_plate_is_a_fault_and_counted() -> None:
    cable = Cable()
    plate = cable.plate()
    hold(cable, plate, 22.0, 1.0)
    cable.is_cut = True
    plate.command(22.0, 0.25, cable.clock.now)
    plate.poll()
    reading = plate.advance(cable.clock.now)

    assert reading.faults == ("plate_unplugged",)
    assert reading.plate_c is None
    assert plate.counts["losses"] == 1


def test_noise_on_the_line_is_counted_and_does_no_harm() -> None:
    cable = Cable()
    plate = cable.plate()
    cable.noise = b"\x00\x13noise\x00"
    readings = hold(cable, plate, 24.0, 6.0)

    assert readings[-1].plate_c == pytest.approx(24.0, abs=0.3)
    assert plate.counts["bad_frames"] >= 250


def test_a_line_that_loses_2_percent_of_its_bytes_keeps_the_setpoint() -> None:
    cable = Cable()
    plate = cable.plate()
    cable.lost_share = 0.02
    readings = hold(cable, plate, 24.0, 20.0)

    silent = [reading for reading in readings if reading.faults]
    # Ten reports lost in a row: silent, or garbled where their other bytes still arrive.
    assert {reading.faults for reading in silent} <= {("plate_silent",), ("plate_garbled",)}
    assert len(silent) < 0.05 * len(readings)
    held = [reading.plate_c for reading in readings[-500:] if reading.plate_c is not None]
    assert held == pytest.approx([24.0] * len(held), abs=0.5)
    assert plate.counts["bad_frames"] + plate.counts["board_bad_frames"] > 20
    plate.off(cable.clock.now)
    leave(cable, plate, 1.0)
    assert cable.board.plate.state is plate_protocol.State.OFF


def test_a_fault_is_cleared_by_name_once_its_cause_is_gone() -> None:
    cable = Cable(lambda: SimulatedBoard(SimulatedPlate(ambient_c=56.0)))
    plate = cable.plate()
    assert hold(cable, plate, 32.0, 1.0)[-1].faults == ("sink_hot",)
    with pytest.raises(DeviceError, match="cause is still there"):
        plate.clear("sink_hot")
    cable.board.plate._plant = Plant()
    leave(cable, plate, 0.2)
    plate.clear("12")

    assert leave(cable, plate, 0.2)[-1].faults == ()
    with pytest.raises(DeviceError, match="sink_hot is not latched"):
        plate.clear("sink_hot")


def test_a_clear_that_is_not_answered_is_said_so() -> None:
    cable = Cable()
    plate = cable.plate()
    cable.is_mute = True
    begun = cable.clock.now

    with pytest.raises(DeviceError, match="answered nothing"):
        plate.clear("runaway")
    assert cable.clock.now - begun == pytest.approx(1.0, abs=0.1)


@pytest.fixture
def running() -> Iterator[tuple[Cable, Peltier]]:
    """A plate whose thread runs on wall-clock time."""
    cable = Cable()
    plate = Peltier("cable", open_port=WallCable(cable).open)
    plate.start()
    yield cable, plate
    plate.close()


class WallCable:
    """The same cable on wall-clock time."""

    def __init__(self, cable: Cable) -> None:
        self._cable = cable

    def open(self, asked: str) -> SimulatedPort:
        port = self._cable.open(asked)
        port._clock, port._wait = time.monotonic, port._cancelled.wait
        return port


def test_a_thread_follows_the_plate_and_ends_with_it(running: tuple[Cable, Peltier]) -> None:
    _, plate = running
    until(lambda: plate.advance(time.monotonic()).plate_c is not None)
    assert [thread.name for thread in threading.enumerate()].count("plate") == 1
    plate.close()

    assert "plate" not in [thread.name for thread in threading.enumerate()]


def is_priority_permitted() -> bool:
    """Whether a thread may have real-time priority; the one that asks ends here."""
    with ThreadPoolExecutor(1) as threads:
        return threads.submit(request_priority).result()


@pytest.mark.skipif(not is_priority_permitted(), reason="needs the right to real-time priority")
@pytest.mark.parametrize(
    ("plate", "policy"),
    [
        (simulated_plate(realtime=True), "SCHED_FIFO"),
        (simulated_plate(), "SCHED_OTHER"),
        (Peltier("cable", open_port=Cable().open), "SCHED_OTHER"),
    ],
)
def test_the_thread_has_real_time_priority_if_asked_so_that_a_busy_loop_holds_up_no_off(
    plate: Peltier, policy: str
) -> None:
    plate.start()
    try:
        (thread,) = (each for each in threading.enumerate() if each.name == "plate")
        assert thread.native_id is not None
        until(lambda: plate.advance(time.monotonic()).plate_c is not None)
        assert os.sched_getscheduler(thread.native_id) == getattr(os, policy)
    finally:
        plate.close()


@pytest.mark.realtime
def test_a_replugged_plate_comes_back_and_waits_for_a_fresh_command(
    running: tuple[Cable, Peltier],
) -> None:
    cable, plate = running
    going_on = threading.Event()

    def command() -> None:
        while not going_on.wait(TURN_S):
            plate.command(22.0, 0.25, time.monotonic())

    caller = threading.Thread(target=command)
    caller.start()
    try:
        until(lambda: cable.board.plate.state is plate_protocol.State.HOLDING)
        cable.is_cut = True
        until(lambda: plate.advance(time.monotonic()).faults == ("plate_unplugged",))
        cable.is_cut = False
        until(lambda: plate.advance(time.monotonic()).plate_c is not None)
        time.sleep(1.0)
        assert cable.opened == 2
        assert cable.board.plate.state is plate_protocol.State.OFF
    finally:
        going_on.set()
        caller.join()
    time.sleep(0.6)
    plate.command(22.0, 5.0, time.monotonic())
    until(lambda: cable.board.plate.state is plate_protocol.State.HOLDING)


class StuckPort:
    """A port whose reads all take very long."""

    def __init__(self) -> None:
        self.released = threading.Event()

    def read(self, _: int) -> bytes:
        self.released.wait(20.0)
        return b""

    def write(self, data: bytes) -> int:
        return len(data)

    def close(self) -> None:
        self.released.set()


def test_a_port_that_is_stuck_holds_up_nobody(running: tuple[Cable, Peltier]) -> None:
    _, plate = running
    stuck = StuckPort()
    plate._port = stuck
    until(lambda: plate.advance(time.monotonic()).faults == ("plate_silent",))
    begin = time.process_time()
    for _ in range(200):
        plate.command(22.0, 0.25, time.monotonic())
        plate.advance(time.monotonic())
        plate.rest(time.monotonic())
    spent_s = time.process_time() - begin

    assert not stuck.released.is_set()
    assert spent_s < 1.0
    stuck.released.set()


class PatientPort(StuckPort):
    """A port whose read ends only when it is cancelled or closed; it keeps what was written."""

    def __init__(self) -> None:
        super().__init__()
        self.written = b""
        self.cancelled = 0
        self.is_over = False
        self.is_read = threading.Event()

    def read(self, size: int) -> bytes:
        self.is_read.set()
        super().read(size)
        if not self.is_over:
            self.released.clear()
        return b""

    def write(self, data: bytes) -> int:
        self.written += data
        return len(data)

    def cancel_read(self) -> None:
        self.cancelled += 1
        self.released.set()

    def sent(self) -> list[plate_protocol.Message]:
        return [plate_protocol.decode(frame) for frame in Deframer().feed(self.written)]


@pytest.fixture
def patient(running: tuple[Cable, Peltier]) -> Iterator[PatientPort]:
    """A port that the plate's thread reads from, in a read that does not end by itself."""
    _, plate = running
    port = PatientPort()
    plate._port = port
    assert port.is_read.wait(60.0 * PACE)
    yield port
    port.is_over = True
    port.released.set()


def test_the_first_command_waits_for_no_read_that_goes_on(
    running: tuple[Cable, Peltier], patient: PatientPort
) -> None:
    _, plate = running
    plate.command(22.0, 5.0, time.monotonic())
    until(lambda: patient.written)
    assert isinstance(patient.sent()[0], plate_protocol.Setpoint)
    for _ in range(20):
        plate.command(22.0, 5.0, time.monotonic())
    assert patient.cancelled == 1, "a renewal can wait for the read to end"


def test_a_changed_setpoint_and_the_end_of_a_touch_wait_for_no_read_that_goes_on(
    running: tuple[Cable, Peltier], patient: PatientPort
) -> None:
    _, plate = running
    for number, setpoint_c in enumerate((22.0, 22.5), start=1):
        plate.command(setpoint_c, 5.0, time.monotonic())
        until(lambda sent=number: len(patient.sent()) == sent)  # type: ignore[misc]
        time.sleep(0.04)
    changed = patient.sent()[-1]
    assert isinstance(changed, plate_protocol.Setpoint)
    assert changed.setpoint_mc == 22_500
    plate.rest(time.monotonic())
    until(lambda: plate_protocol.Rest() in patient.sent())


def test_a_simulated_plate_that_is_driven_lives_on_when_it_is_looked_at(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # Its thread would hold up touches at moments of its own.
    plate = simulated_plate()
    plate.start()
    try:
        plate.command(22.0, 60.0, time.monotonic())
        until(lambda: plate.advance(time.monotonic()).duty < 0.0)
        monkeypatch.setattr(SimulatedPort, "longest_read_s", lambda _: 3600.0)
        time.sleep(2.0 / 20)  # the thread reads that long by now
        until(lambda: plate.advance(time.monotonic()).plate_c == pytest.approx(22.0, abs=0.3))
        assert plate.advance(time.monotonic()).faults == ()
    finally:
        plate.close()


def test_an_off_waits_for_no_read_that_goes_on(
    running: tuple[Cable, Peltier], patient: PatientPort
) -> None:
    _, plate = running
    plate.off(time.monotonic())
    until(lambda: patient.written)
    assert patient.sent()[0] == plate_protocol.Off()


def info(device: str, vid: int | None = None, **more: object) -> SimpleNamespace:
    usb = {"pid": 1, "serial_number": "s", "location": "1-2"}
    fields = {"description": "n/a", "product": None} | usb | more
    return SimpleNamespace(device=device, vid=vid, **fields)


def test_a_port_is_likely_by_its_usb_vendor_or_its_description() -> None:
    assert ports._is_likely(info("COM3", 0x2341))
    assert ports._is_likely(info("COM4", 0x1A86))
    assert ports._is_likely(info("COM5", description="USB-SERIAL CH340 (COM5)"))
    assert not ports._is_likely(info("COM1", description="Communications Port"))
    assert not ports._is_likely(info("COM6", 0x8087, description="Modem"))


@pytest.mark.skipif(os.name != "posix", reason="pseudo terminals are posix")
def test_a_real_serial_port_carries_the_conversation() -> None:
    import pty
    import tty

    master, slave = pty.openpty()
    tty.setraw(master)
    board, ending = SimulatedBoard(), threading.Event()

    def run() -> None:
        os.set_blocking(master, False)
        while not ending.wait(READ_S / 2):
            try:
                data = os.read(master, 512)
            except BlockingIOError:
                data = b""
            os.write(master, board.exchange(data, time.monotonic()))

    firmware = threading.Thread(target=run)
    firmware.start()
    plate = Peltier(os.ttyname(slave))
    try:
        plate.start()
        plate.command(22.0, 5.0, time.monotonic())
        until(lambda: plate.advance(time.monotonic()).duty < 0.0)
        assert "firmware 0.0.0" in plate.name
        plate._port.timeout = 20.0  # type: ignore[union-attr]
        time.sleep(2 * READ_S)  # the thread reads that long by now
        plate.off(time.monotonic())
        until(lambda: board.plate.state is plate_protocol.State.OFF)
        with pytest.raises(DeviceError, match="another program has it open"):
            Peltier(os.ttyname(slave)).connect()
        plate.close()
        assert board.plate.state is plate_protocol.State.OFF
    finally:
        plate.close()
        ending.set()
        firmware.join()
        os.close(master)
        os.close(slave)


def test_the_plate_command_tells_the_plate_and_its_faults(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["plate", "status", "--peltier", "simulated"]) == 0
    output = capsys.readouterr().out
    assert "simulated plate\n" in output
    assert "no faults" in output
    assert main(["plate", "status", "--peltier", "simulated", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["plate_c"] > 30.0
