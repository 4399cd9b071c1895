"""Lists the outputs that people own already: one row each, by the name in `serve --hand`."""

from __future__ import annotations

import contextlib

from websockets.exceptions import WebSocketException

from hapticvlm.devices.speaker.engine import AudioSettings
from hapticvlm.devices.worn.intiface import Intiface
from hapticvlm.devices.worn.output import WornOutput
from hapticvlm.devices.worn.touchdiver import TouchDiver

HOST = "127.0.0.1"


WORN: dict[str, type[WornOutput]] = {"weart": TouchDiver, "intiface": Intiface}


def place(option: str) -> tuple[str, str, int]:
    """Return name, host and port of NAME or NAME=HOST:PORT. Raises ValueError."""
    name, _, address = option.partition("=")
    if name not in WORN:
        raise ValueError(f"--hand: `{name[:60]}`: choose one of {', '.join(WORN)}")
    host, _, port = (address or f"{HOST}:{WORN[name].port}").rpartition(":")
    if not host or not port.isdecimal() or not 0 < int(port) < 65_536:
        raise ValueError(f"--hand: {address[:60]} is not HOST:PORT; leave it out, or give both")
    return name, host, int(port)


def answers(option: str) -> str | None:
    """Return in words what the program of NAME or NAME=HOST:PORT answers, or None."""
    with contextlib.suppress(OSError, ValueError, WebSocketException):
        name, host, port = place(option)
        return WORN[name].ask(host, port)
    return None


def make(option: str, settings: AudioSettings) -> tuple[WornOutput, ...]:
    """Return the outputs that `serve --hand` names, parted by commas. Raises ValueError."""
    places = [place(each) for each in option.split(",")]
    return tuple(WORN[name](host, port, settings) for name, host, port in places)
