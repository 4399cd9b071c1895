"""Lists the serial ports that may lead to a plate, and opens them. Only this module uses pyserial.

A port is chosen by its USB identity (vendor, product, serial number), so that a plate that is
plugged in again is recognised although the system may give it another name.
"""

from __future__ import annotations

import errno
import os
from dataclasses import dataclass
from typing import Any, Protocol

from hapticvlm.devices.errors import DeviceError
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
    usb: tuple[int, int, str] | None = None

    @property
    def text(self) -> str:
        """Name and description, as shown to a person."""
        return f"{self.url} ({self.label})" if self.label else self.url


def candidate_ports(address: str) -> list[PortInfo]:
    """Return the port at `address`; for `auto`, every port that may lead to a plate.

    Raises DeviceError, naming every port of this machine, when `auto` finds none.
    """
    if address != AUTO:
        return [PortInfo(address, "")]
    present = _present()
    likely = [port_info for port_info, is_likely in present if is_likely]
    if not likely:
        raise DeviceError(
            f"no port looks like a plate; ports seen: {_listed([info for info, _ in present])}; "
            "plug the plate in, or name its port"
        )
    return likely


def open_port(url: str) -> Port:
    """Open a port, by name or pyserial URL, for this program alone. Raises DeviceError."""
    import serial

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
    number = error.errno if isinstance(error, OSError) else None
    if number in (errno.EAGAIN, errno.EBUSY):
        return "another program has it open, perhaps `hapticvlm serve`"
    return os.strerror(number) if number else str(error)


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
        (info.vid, info.pid, info.serial_number or ""),
    )


def _is_likely(info: Any) -> bool:  # noqa: ANN401
    words = f"{info.description} {info.product}".lower()
    return info.vid in _VENDORS or any(word in words for word in _WORDS)


def _listed(ports: list[PortInfo]) -> str:
    return ", ".join(port_info.text for port_info in ports) or "none"
