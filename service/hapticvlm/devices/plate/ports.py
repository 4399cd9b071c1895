"""Lists the serial ports that may lead to a plate, and opens them. Only this module uses pyserial.

Opening a port resets most boards, and one that is not a plate may be in the middle of a print. So
`auto` opens only ports at which a plate has answered before, and nothing else since
(`known_plates.py`). All others are named, and the user names one.
"""

from __future__ import annotations

import errno
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from hapticvlm.devices.errors import DeviceError
from hapticvlm.devices.plate import known_plates
from hapticvlm.devices.plate.known_plates import Known, UsbIdentity
from hapticvlm.devices.plate.protocol import BAUD

AUTO = "auto"
READ_S = 0.02
WRITE_S = 0.2

# USB vendor ids of boards, and of the serial chips on boards that copy them; our list.
_VENDORS = {
    0x2341: "Arduino",
    0x2A03: "Arduino",
    0x1A86: "CH340",
    0x0403: "FTDI",
    0x10C4: "CP210x",
    0x067B: "PL2303",
}
_WORDS = ("arduino", "ch340", "usb serial", "usb-serial", "cp210", "ft232")


NAME_IT = "name the plate's port once: --peltier PORT"


class UnknownPortsError(DeviceError):
    """Raised when `auto` finds ports, but no plate has ever answered at any of them."""


class Port(Protocol):
    """The part of a pyserial port that is used: reads that end after READ_S, writes, close."""

    def read(self, size: int, /) -> bytes:
        """Return `size` bytes, or those that arrived within READ_S."""

    def write(self, data: bytes, /) -> int | None:
        """Write all of `data`, or raise OSError after WRITE_S."""

    def close(self) -> None:
        """Close the port."""


@dataclass(frozen=True, slots=True)
class PortInfo:
    """A port: its name or pyserial URL, the system's description, and its USB identity if any."""

    url: str
    label: str
    usb: UsbIdentity | None = None

    @property
    def text(self) -> str:
        """Name and description, as shown to a person."""
        return f"{self.url} ({self.label})" if self.label else self.url


def candidate_ports(address: str) -> list[PortInfo]:
    """Return the port at `address`; for `auto`, the ports that may be asked for a plate.

    Raises DeviceError, naming the ports, when `auto` may ask none.
    """
    if address != AUTO:
        return [_named(address)]
    present = _present()
    likely = [port_info for port_info, is_likely in present if is_likely]
    if not likely:
        raise DeviceError(
            f"no port looks like a plate; ports seen: {_listed([info for info, _ in present])}; "
            "plug the plate in, or name its port, such as --peltier COM3 or --peltier /dev/ttyUSB0"
        )
    usb = [port_info.usb for port_info, _ in present if port_info.usb is not None]
    return _known_among(likely, known_plates.forget_unplugged(usb))


def present() -> list[PortInfo]:
    """Return every port of this machine."""
    return [port_info for port_info, _ in _present()]


def is_present(url: str) -> bool:
    """Return whether a port of that name exists; a pyserial URL always does."""
    return "://" in url or Path(url).exists() or any(info.url == url for info, _ in _present())


def remember(port_info: PortInfo) -> None:
    """Let `auto` open this port from now on: a plate has answered at it."""
    if port_info.usb is not None:
        known_plates.remember(port_info.usb)


def _known_among(likely: Sequence[PortInfo], known: Known) -> list[PortInfo]:
    own = [place for place in likely if place.usb in known.plates and known.may_open(place.usb)]
    if own:
        return own
    raise UnknownPortsError(
        f"no plate has answered yet at {_listed(likely)}; opening a port resets the board behind "
        f"it, so {NAME_IT if len(likely) > 1 else NAME_IT.replace('PORT', likely[0].url)}"
    )


def _named(address: str) -> PortInfo:
    """Return the port of this name, with its USB identity if it is a USB device that is present."""
    if "://" in address:
        return PortInfo(address, "")
    file = os.path.realpath(address)  # of a link in /dev/serial/by-id
    usb = [info.usb for info, _ in _present() if os.path.realpath(info.url) == file]
    return PortInfo(address, "", usb[0] if usb else None)


def open_port(url: str) -> Port:
    """Open a port, by name or pyserial URL, for this program alone. Raises DeviceError."""
    import serial

    if Path(url).is_file():
        raise DeviceError("a file, and not a serial port")
    try:
        port: Port = serial.serial_for_url(
            url, baudrate=BAUD, timeout=READ_S, write_timeout=WRITE_S, **_exclusive(url)
        )
    except (serial.SerialException, OSError, ValueError) as error:
        raise DeviceError(f"can't be opened: {_reason(error)}") from None
    return port


def _exclusive(url: str) -> dict[str, Any]:
    return {} if "://" in url else {"exclusive": True}


def _reason(error: Exception) -> str:
    # pyserial puts the system's error behind one of its own, and for an address without a port a
    # TypeError or its like, which says nothing to a user.
    cause = error if getattr(error, "errno", None) else error.__context__ or error
    if isinstance(cause, TypeError | ValueError | KeyError):
        return "no address of a port; write it as socket://HOST:PORT"
    number = next(iter(cause.args), None)  # termios has an error of its own, with the same number
    if number in (errno.EAGAIN, errno.EBUSY):
        return "another program has it open, perhaps `hapticvlm serve`"
    if number == errno.ENOTTY:
        return "not a serial port"
    if isinstance(number, int) and number > 0:
        return os.strerror(number)
    return getattr(cause, "strerror", "") or str(error)


def _present() -> list[tuple[PortInfo, bool]]:
    from serial.tools import list_ports

    return [(_port_info(info), _is_likely(info)) for info in sorted(list_ports.comports())]


def _port_info(info: Any) -> PortInfo:  # noqa: ANN401 - pyserial has no types
    label = info.description if info.description not in (None, "n/a") else ""
    if info.vid is None:
        return PortInfo(info.device, label)
    return PortInfo(
        info.device,
        f"{label} {info.vid:04x}:{info.pid:04x}".strip(),
        # A system that tells no USB path keeps the name of a port at its socket, or there is one.
        UsbIdentity(
            info.vid, info.pid, info.serial_number or "", info.location or str(info.device)
        ),
    )


def _is_likely(info: Any) -> bool:  # noqa: ANN401
    words = f"{info.description} {info.product}".lower()
    return info.vid in _VENDORS or any(word in words for word in _WORDS)


def _listed(ports: Sequence[PortInfo]) -> str:
    return ", ".join(port_info.text for port_info in ports) or "none"
