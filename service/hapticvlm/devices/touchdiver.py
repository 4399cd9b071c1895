"""Drives WEART TouchDIVER gloves through the maker's program (Middleware or WEART App), over TCP.

The program takes texts that end with `~`: `texture:12:0.5:0.0:0.2:80.0:RIGHT:PALM` (index, velocity
as three numbers, volume in percent), `force:0.3:0.0:0.0:...`, `temperature:0.4:...` (0.5 is
neutral), and a stop of each. A thread of its own sends what has changed, so no touch waits for the
program, and what the program misses while it is away is not sent later. Every value ends with its
lease, by a stop. The program rests the gloves when this connection ends (not tried on a device).
"""

from __future__ import annotations

import contextlib
import json
import logging
import select
import socket
import threading
import time
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType

from hapticvlm.devices.faults import GLOVE_GONE
from hapticvlm.materials import Material
from hapticvlm.perception import NEUTRAL_C
from hapticvlm.rendering.vibration.vibration import IMPACTS
from hapticvlm.rendering.vibration.voices import Command

HOST, PORT = "127.0.0.1", 13031
HANDS = ("LEFT", "RIGHT")
POINTS = ("THUMB", "INDEX", "MIDDLE", "PALM")
CLICK, SOFT_CLICK = 0, 1
# The index of the glove's own texture for each material. Where it has none, the nearest by feel:
# glass and ceramic are hard and smooth, so they get bare aluminium; their roughness makes it faint.
TEXTURES: Mapping[str, int] = MappingProxyType(
    {
        "wood": 12,  # silver oak
        "glass": 20,  # aluminium
        "fabric": 19,  # cotton
        "metal": 20,  # aluminium
        "plastic": 17,  # plastic foil
        "stone": 11,  # Venetian granite
        "ceramic": 20,  # aluminium
        "paper": 13,  # laminated wood, the smoothest dry fibre
        "leather": 18,  # leather
        "rubber": 14,  # profiled rubber
        "foliage": 9,  # textile mesh
    }
)
SOFT = frozenset({"fabric", "leather", "rubber", "paper", "foliage"})
FULL_FORCE_N = 5.0  # our choice: a firm touch of a palm is the glove's full force
FASTEST = 0.5  # of the glove's velocity, which is taken as m/s
LOUDEST_MPS = 0.5  # an impact of this speed has the full volume
CLICK_S = 0.06
SPAN_C = 28.0  # our choice: 18 degC is 0 and 46 would be 1; the maker publishes no scale
TICK_S = 0.02
AGAIN_S = 1.0  # between attempts to connect
ASK_S = 2.0  # between questions for the state
SEND_S = 0.5  # for a program that does not read
MOST_BYTES = 65_536  # of an answer without an end

logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Felt:
    """The feel of one hand: force 0..1, a texture by index, until `expires_at`."""

    expires_at: float
    force: float = 0.0
    texture: int | None = None
    velocity: float = 0.0
    volume: float = 0.0
    click: int | None = None
    clicks_until: float = 0.0


@dataclass(slots=True)
class Wanted:
    """What both gloves are to feel: forces and textures by hand (0 left), heat on the latest."""

    hands: dict[int, Felt] = field(default_factory=dict)
    temperature: float = 0.5
    warm_until: float = 0.0
    latest: int = 1  # the hand of the latest command, which the heat follows
    gain: float = 1.0


def messages(wanted: Wanted, now: float) -> dict[tuple[str, str], str]:
    """Return the values of each kind and hand; what is absent is at rest."""
    values = {}
    for number, felt in wanted.hands.items():
        if now >= felt.expires_at:
            continue
        hand = HANDS[number]
        if felt.force > 0.0:
            values["force", hand] = f"{felt.force:.2f}:0.0:0.0"
        clicks = felt.click is not None and now < felt.clicks_until
        texture = felt.click if clicks else felt.texture
        volume = round(felt.volume * wanted.gain)
        if texture is not None and volume > 0:
            velocity = FASTEST if clicks else felt.velocity
            values["texture", hand] = f"{texture}:0.5:0.0:{velocity:.2f}:{volume}.0"
    if now < wanted.warm_until and wanted.temperature != 0.5:
        values["temperature", HANDS[wanted.latest]] = f"{wanted.temperature:.2f}"
    return values


class TouchDiver:
    """Both gloves; call `start`, then command them from one thread. Only `close` blocks."""

    simulated = False

    def __init__(self, host: str, port: int, table: Mapping[str, Material]) -> None:
        self._address = (host, port)
        self._table = table
        self._wanted = Wanted()
        self._changed = threading.Condition()
        self._is_closed = False
        self._thread = threading.Thread(target=self._run, name="touchdiver", daemon=True)
        self._connected_at: float | None = None
        self.name = f"TouchDIVER at {host}:{port}"
        self.state = "not connected"

    @classmethod
    def at(cls, address: str, table: Mapping[str, Material]) -> TouchDiver:
        """Return the gloves of the program at `HOST:PORT`, by default on this machine.

        Raises ValueError.
        """
        host, _, port = (address or f"{HOST}:{PORT}").rpartition(":")
        if not host or not port.isdecimal() or not 0 < int(port) < 65_536:
            raise ValueError(f"hand: {address[:60]} is no HOST:PORT; leave it out, or give both")
        return cls(host, int(port), table)

    @property
    def faults(self) -> tuple[str, ...]:
        """Names of the current faults."""
        return () if self._connected_at is not None else (GLOVE_GONE.name,)

    def start(self) -> None:
        """Begin to look for the maker's program; it may be started later."""
        self._thread.start()

    def play(self, command: Command) -> None:
        """Render this motion of one hand until its lease ends."""
        material = None if command.material is None else self._table.get(command.material)
        old = self._wanted.hands.get(command.hand)
        felt = felt_of(command, material, old, time.monotonic())
        with self._changed:
            self._wanted.hands[command.hand] = felt
            self._wanted.latest = command.hand
            self._changed.notify()

    def release(self, hand: int) -> None:
        """Rest one hand."""
        with self._changed:
            self._wanted.hands.pop(hand, None)
            self._changed.notify()

    def set_gain(self, gain: float) -> None:
        """Scale the volume of textures by `gain` (0..1) from now on."""
        with self._changed:
            self._wanted.gain = gain

    def warm(self, setpoint_c: float, ttl_s: float) -> None:
        """Warm or cool the hand of the latest touch to `setpoint_c` for `ttl_s`."""
        temperature = round(min(max(0.5 + (setpoint_c - NEUTRAL_C) / SPAN_C, 0.0), 1.0), 2)
        with self._changed:
            self._wanted.temperature = temperature
            self._wanted.warm_until = time.monotonic() + ttl_s

    def rest_heat(self) -> None:
        """Return to the neutral temperature."""
        with self._changed:
            self._wanted.warm_until = 0.0
            self._changed.notify()

    def rest_vibration(self) -> None:
        """Rest forces and textures of both hands."""
        with self._changed:
            self._wanted.hands.clear()
            self._changed.notify()

    def close(self) -> None:
        """Rest both gloves, tell the program that this client stops, and end the thread."""
        with self._changed:
            self._is_closed = True
            self._wanted = Wanted(gain=self._wanted.gain)
            self._changed.notify()
        if self._thread.is_alive():
            self._thread.join(AGAIN_S + 2.0 * SEND_S)

    def _run(self) -> None:
        while not self._is_closed:
            try:
                with socket.create_connection(self._address, AGAIN_S) as connection:
                    connection.settimeout(SEND_S)
                    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                    self._serve(connection)
            except (OSError, ValueError) as error:
                if self._connected_at is not None:
                    logger.warning("%s is gone: %s", self.name, error)
            self._connected_at, self.state = None, "not connected"
            with self._changed:
                if not self._is_closed:
                    self._changed.wait(AGAIN_S)

    def _serve(self, connection: socket.socket) -> None:
        """Send every change until `close`. Raises OSError when the program is gone."""
        _send(connection, "StartFromClient")
        self._connected_at, self.state = time.monotonic(), "connected"
        logger.warning("%s is connected", self.name)
        sent: dict[tuple[str, str], str] = {}
        answers, asked_at = b"", float("-inf")
        while True:
            with self._changed:
                if not self._is_closed:
                    self._changed.wait(TICK_S)
                is_closed = self._is_closed
                wanted = replace(self._wanted, hands=dict(self._wanted.hands))
            now = time.monotonic()
            values = messages(wanted, now)
            _send(connection, *changes(sent, values))
            sent = values
            if is_closed:
                _send(connection, "StopFromClient")
                return
            if now - asked_at >= ASK_S:
                asked_at = now
                _send(
                    connection, json.dumps({"type": "MW_GET_STATUS", "ts": int(time.time() * 1e3)})
                )
            answers = self._read(connection, answers)

    def _read(self, connection: socket.socket, before: bytes) -> bytes:
        """Take the answers that are there; return the beginning of the next one."""
        while select.select([connection], [], [], 0.0)[0]:
            more = connection.recv(4096)
            if not more:
                raise ConnectionError("the program closed the connection")
            *whole, before = (before + more).split(b"~")
            for text in whole:
                self.state = state_in(text.decode(errors="replace")) or self.state
            if len(before) > MOST_BYTES:
                raise ConnectionError("an answer without an end")
        return before


def felt_of(command: Command, material: Material | None, old: Felt | None, now: float) -> Felt:
    """Return the glove's feel of this command; `old` is what the hand feels now."""
    rests = Felt(command.expires_at, min(command.motion.force_n / FULL_FORCE_N, 1.0))
    if material is None:
        return rests
    kind = material.name if material.like is None else material.like
    loud = 100.0 * command.gain
    if command.onset:
        share = min(command.motion.speed_mps / LOUDEST_MPS, 1.0)
        click = SOFT_CLICK if kind in SOFT else CLICK
        rests = replace(rests, volume=loud * share, click=click, clicks_until=now + CLICK_S)
    elif old is not None and now < old.clicks_until:
        rests = replace(rests, volume=old.volume, click=old.click, clicks_until=old.clicks_until)
    if command.interaction in IMPACTS or command.motion.speed_mps <= 0.0:
        return rests
    volume = loud * (0.3 + 0.7 * material.vibration.roughness)
    velocity = min(command.motion.speed_mps, FASTEST)
    return replace(rests, texture=TEXTURES.get(kind), velocity=velocity, volume=volume)


def changes(
    sent: Mapping[tuple[str, str], str], values: Mapping[tuple[str, str], str]
) -> list[str]:
    """Return the texts that turn what was sent into these values."""
    stops = [
        (f"stop{kind.capitalize()}", hand) for kind, hand in sent if (kind, hand) not in values
    ]
    new = [
        (f"{kind}:{value}", hand)
        for (kind, hand), value in values.items()
        if sent.get((kind, hand)) != value
    ]
    return [f"{text}:{hand}:{point}" for text, hand in (*stops, *new) for point in POINTS]


def state_in(text: str) -> str | None:
    """Return in words what this answer of the program says of the gloves; None: nothing."""
    name, *fields = text.split(":")
    match name, fields:
        case "CalibrationStatus", [_, "1"]:
            return "calibrating: keep the hand still"
        case "CalibrationStatus", [_, _]:
            return "running"
        case "CalibrationResult", [_, result]:
            return "running" if result == "0" else "calibration failed: start it again"
    with contextlib.suppress(ValueError, RecursionError):
        match json.loads(text):
            case {"type": "MW_STATUS" | "WA_STATUS", "data": {"connectedDevices": []}}:
                return "no glove is connected to the program"
            case {"type": "MW_STATUS" | "WA_STATUS", "data": {"status": str(status)}}:
                return status.lower().replace("_", " ")
    return None


def _send(connection: socket.socket, *texts: str) -> None:
    if texts:
        connection.sendall("".join(f"{text}~" for text in texts).encode())
