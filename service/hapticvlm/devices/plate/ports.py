"""Serial ports: which may lead to a plate, and how one is opened. The only home of pyserial."""

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

# USB vendors of boards and of the serial chips on their copies; our list.
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
    """What is used of a pyserial port: bulk reads that end after READ_S, writes, close."""

    def read(self, size: int, /) -> bytes:
        """Return up to `size` bytes, after READ_S what there is."""

    def write(self, data: bytes, /) -> int | None:
        """Write all of it, or raise after WRITE_S."""

    def close(self) -> None:
        """Close the port."""


@dataclass(frozen=True, slots=True)
class PortInfo:
    """A port by name or pyserial URL, its description by the system, its USB identity if any."""

    url: str
    label: str
    usb: tuple[int, int, str] | None = None

    @property
    def text(self) -> str:
        """How a person finds it."""
        return f"{self.url} ({self.label})" if self.label else self.url


def candidate_ports(address: str) -> list[PortInfo]:
    """Return the port asked for, or with `auto` those that may lead to a plate, likeliest first.

    Raises DeviceError, naming every port there is, when `auto` finds none.
    """
    if address != AUTO:
        return [PortInfo(address, "")]
    present = _present()
    likely = [port_info for port_info, is_likely in present if is_likely]
    if not likely:
        raise DeviceError(
            f"no port looks like a plate; ports present: {_listed([port_info for port_info, _ in present])}; "
            "plug the plate in, or name its port"
        )
    return likely


def open_port(url: str) -> Port:
    """Open a port by name or pyserial URL for this program alone. Raises DeviceError."""
    import serial

    try:
        found: Port = serial.serial_for_url(
            url, baudrate=BAUD, timeout=READ_S, write_timeout=WRITE_S, **_exclusive(url)
        )
    except (serial.SerialException, OSError, ValueError) as error:
        raise DeviceError(f"can't be opened: {_reason(error)}") from None
    return found


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


def _listed(found: list[PortInfo]) -> str:
    return ", ".join(port_info.text for port_info in found) or "none"
