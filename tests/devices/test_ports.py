"""Tests that a port is opened only where a plate answered before; the foreign ports are real."""

from __future__ import annotations

import errno
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any, cast

import pytest
from plate_ports import Cable
from serial import SerialException

from hapticvlm.devices.errors import DeviceError
from hapticvlm.devices.plate import known_plates, ports
from hapticvlm.devices.plate.known_plates import UsbIdentity
from hapticvlm.devices.plate.peltier import Peltier
from hapticvlm.devices.plate.ports import Port, PortInfo
from hapticvlm.doctor.devices import plates
from hapticvlm.server.settings import ServeOptions

pty = pytest.importorskip("pty", reason="pseudo terminals are posix")

CH340 = (0x1A86, 0x7523, "")
PLATE, MOVED = "/dev/plate-of-a-test", "/dev/plate-of-a-test-elsewhere"


class Desk:
    """A plate and foreign boards with the same USB chip; `plugged` is what the system lists."""

    def __init__(self) -> None:
        self.cable = Cable()
        self.opened: list[str] = []
        self.greeting = b""  # of a foreign board when it is opened
        self.foreign: dict[str, int] = {}
        self.plugged: dict[str, str] = {PLATE: "1-2"}
        for _ in range(2):
            master, slave = pty.openpty()
            os.set_blocking(master, False)
            self.foreign[os.ttyname(slave)] = master
            os.close(slave)
        self.sockets = dict(zip(self.foreign, ("1-3", "1-4"), strict=True))
        self.plugged |= self.sockets

    def listed(self) -> list[tuple[PortInfo, bool]]:
        """What the system lists."""
        return [
            (PortInfo(url, "USB Serial", UsbIdentity(*CH340, socket)), True)
            for url, socket in sorted(self.plugged.items())
        ]

    def open(self, url: str) -> Port:
        """Open a foreign board's real port, or the plate's."""
        self.opened.append(url)
        if url in self.foreign:
            port: Any = ports.open_port(url)
            port.timeout = 0  # the test's clock waits
            os.write(self.foreign[url], self.greeting)
            return cast(Port, port)
        return self.cable.open(url)

    def peltier(self, address: str) -> Peltier:
        """A plate that is not connected yet."""
        return Peltier(address, open_port=self.open, clock=self.cable.clock)

    def unplug(self) -> None:
        """Pull the plate's cable."""
        self.cable.is_cut = True
        self.plugged.pop(PLATE)

    def plug(self, url: str = PLATE, socket: str = "1-2") -> None:
        """Plug the plate in."""
        self.cable.is_cut = False
        self.plugged[url] = socket

    def written(self) -> bytes:
        """All bytes that the foreign boards were sent."""
        data = b""
        for master in self.foreign.values():
            try:
                data += os.read(master, 4096)
            except OSError:
                continue  # nothing came, or nobody ever opened it
        return data

    def strangers_opened(self) -> list[str]:
        """The foreign ports that were opened."""
        return [url for url in self.opened if url in self.foreign]

    def live(self, plate: Peltier, seconds: float) -> None:
        """Let the plate's thread turn for that long on the clock of the test."""
        until = self.cable.clock.now + seconds
        while self.cable.clock.now < until:
            before = self.cable.clock.now
            plate.poll()
            if self.cable.clock.now == before:
                self.cable.clock.wait(0.02)


@pytest.fixture
def desk(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[Desk]:
    """The desk, and a cache that remembers no plate."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    desk = Desk()
    monkeypatch.setattr(ports, "_present", desk.listed)
    yield desk
    for master in desk.foreign.values():
        os.close(master)


def known(desk: Desk) -> Peltier:
    """A plate whose port was named once, and that `auto` found after that."""
    named = desk.peltier(PLATE)
    named.connect()
    named.close()
    plate = desk.peltier("auto")
    plate.connect()
    return plate


def test_of_several_ports_that_never_answered_none_is_opened_and_all_are_named(desk: Desk) -> None:
    with pytest.raises(DeviceError) as refused:
        desk.peltier("auto").connect()

    assert desk.opened == []
    for url in desk.plugged:
        assert url in str(refused.value)
    assert "--peltier" in str(refused.value)


def test_ten_minutes_beside_two_foreign_boards_write_nothing_to_them(desk: Desk) -> None:
    plate = known(desk)
    desk.live(plate, 5.0)
    desk.unplug()
    desk.live(plate, 600.0)

    assert plate.advance(desk.cable.clock.now).faults == ("plate_unplugged",)
    assert desk.strangers_opened() == []
    assert desk.written() == b""
    desk.plug()
    desk.live(plate, 15.0)
    assert plate.advance(desk.cable.clock.now).plate_c is not None


def test_a_start_without_the_plate_asks_no_foreign_board(desk: Desk) -> None:
    known(desk).close()
    desk.unplug()
    with pytest.raises(DeviceError, match="no plate has answered"):
        desk.peltier("auto").connect()
    desk.plugged.popitem()
    with pytest.raises(DeviceError, match="no plate has answered"):
        desk.peltier("auto").connect()

    assert desk.strangers_opened() == []


def test_the_only_candidate_is_not_opened_before_it_is_named_once(desk: Desk) -> None:
    (lone, socket), *_ = desk.sockets.items()
    desk.plugged = {lone: socket}
    with pytest.raises(DeviceError, match=f"--peltier {lone}"):
        desk.peltier("auto").connect()
    for options in (ServeOptions(), ServeOptions(peltier="auto")):
        (finding,) = plates(options)
        assert lone in finding.message
    assert (desk.opened, desk.written()) == ([], b"")


def test_a_printer_in_the_plates_socket_is_opened_once_until_it_is_unplugged(desk: Desk) -> None:
    plate = known(desk)
    (printer, _), *_ = desk.sockets.items()
    del desk.plugged[printer]
    desk.unplug()
    desk.greeting = b"start\nMarlin 2.1.2\n"
    desk.live(plate, 5.0)
    desk.plugged[printer] = "1-2"
    desk.live(plate, 120.0)
    plate.close()
    with pytest.raises(DeviceError, match="no plate has answered"):
        desk.peltier("auto").connect()
    assert desk.strangers_opened() == [printer]

    del desk.plugged[printer]
    with pytest.raises(DeviceError):
        desk.peltier("auto").connect()
    desk.plug()
    desk.peltier("auto").connect()
    assert desk.opened[-1] == PLATE


@pytest.mark.usefixtures("desk")
def test_a_stranger_with_a_serial_number_is_one_at_every_socket() -> None:
    printer, plate = UsbIdentity(1, 2, "P1", "1-2"), UsbIdentity(1, 2, "P2", "1-2")
    known_plates.remember(plate)
    known_plates.avoid(printer)
    left = known_plates.forget_unplugged([])
    assert left.may_open(plate)
    assert not left.may_open(printer._replace(location="1-9"))
    known_plates.remember(printer)  # it was named, and answered as a plate
    assert known_plates.load().may_open(printer)


def test_a_plate_that_moves_to_another_socket_is_found_and_named_by_its_new_port(
    desk: Desk,
) -> None:
    plate = known(desk)
    desk.unplug()
    desk.live(plate, 30.0)
    desk.plug(MOVED, "1-7")
    desk.live(plate, 15.0)

    assert plate.advance(desk.cable.clock.now).plate_c is not None
    assert MOVED in plate.name
    assert desk.strangers_opened() == []


def test_a_foreign_board_that_appears_while_the_plate_is_gone_is_asked_once(desk: Desk) -> None:
    plate = known(desk)
    (late, socket), *_ = desk.sockets.items()
    desk.plugged.pop(late)
    desk.unplug()
    desk.live(plate, 10.0)
    desk.plugged[late] = socket
    desk.live(plate, 300.0)
    assert desk.strangers_opened() == [late]
    desk.plug()
    desk.live(plate, 15.0)

    assert plate.advance(desk.cable.clock.now).plate_c is not None


def test_a_named_port_that_came_back_under_another_name_is_told_as_renamed(desk: Desk) -> None:
    plate = desk.peltier(PLATE)
    plate.connect()
    desk.unplug()
    desk.live(plate, 10.0)
    assert plate.advance(desk.cable.clock.now).faults == ("plate_unplugged",)
    desk.plug(MOVED, "1-2")
    desk.live(plate, 10.0)

    assert plate.advance(desk.cable.clock.now).faults == ("plate_renamed",)
    assert desk.opened == [PLATE]


def test_a_program_that_reads_along_is_no_unplugged_plate(desk: Desk) -> None:
    plate = known(desk)
    desk.cable.lost_share = 0.5
    seen = set()
    for _ in range(300):
        desk.live(plate, 0.1)
        seen |= set(plate.advance(desk.cable.clock.now).faults)
    desk.cable.lost_share = 0.0
    desk.live(plate, 15.0)

    assert "plate_garbled" in seen
    assert "plate_unplugged" not in seen
    assert plate.advance(desk.cable.clock.now).faults == ()


@pytest.mark.parametrize("deaf_s", [2.0, 6.0])
def test_a_slow_boot_loader_is_waited_for_and_not_reset_again(desk: Desk, deaf_s: float) -> None:
    plate = known(desk)
    desk.unplug()
    desk.live(plate, 5.0)
    desk.plug()
    desk.cable.is_mute = True
    opened = len(desk.opened)
    while len(desk.opened) == opened:
        desk.live(plate, 0.1)
    desk.live(plate, deaf_s)
    desk.cable.is_mute = False
    desk.live(plate, 10.0)

    assert plate.advance(desk.cable.clock.now).plate_c is not None
    assert len(desk.opened) == opened + 1


def test_doctor_opens_no_port_that_never_answered(desk: Desk) -> None:
    (finding,) = plates(ServeOptions(peltier="auto"))

    assert finding.verdict == "wrong"
    assert all(url in finding.message for url in desk.plugged)
    assert "--peltier" in (finding.cure or "")
    assert desk.written() == b""


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (OSError(errno.EBUSY, "busy"), "another program has it open, perhaps `hapticvlm serve`"),
        (OSError(errno.ENOENT, "no"), os.strerror(errno.ENOENT)),
        (Exception(errno.ENOTTY, "as termios says it"), "not a serial port"),
        (SerialException("the board left"), "the board left"),
    ],
)
def test_why_a_port_does_not_open_is_said_in_words(error: Exception, said: str) -> None:
    assert ports._reason(error) == said
