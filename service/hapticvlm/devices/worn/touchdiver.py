"""Drives WEART TouchDIVER gloves through the maker's program (Middleware or WEART App), over TCP.

The program takes texts that end with `~`: `texture:12:0.5:0.0:0.2:80.0:RIGHT:PALM` (index, velocity
as three numbers, volume in percent), `force:0.3:0.0:0.0:...`, `temperature:0.4:...` (0.5 is
neutral), and a stop of each. The program rests the gloves when this connection ends (not tried on
a device).
"""

from __future__ import annotations

import contextlib
import json
import select
import socket
import time
from collections.abc import Mapping
from types import MappingProxyType

from hapticvlm.devices.faults import GLOVE_GONE
from hapticvlm.devices.worn.output import Touch, Wanted, WornOutput
from hapticvlm.materials import Material
from hapticvlm.perception import NEUTRAL_C
from hapticvlm.rendering.vibration.vibration import IMPACTS

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
ASK_S = 2.0  # between questions for the state
SEND_S = 0.5  # for a program that does not read
MOST_BYTES = 65_536  # of an answer without an end
STATUS = {"type": "MW_GET_STATUS"}


class TouchDiver(WornOutput):
    """Both gloves of the maker's program."""

    title, port, gone = "TouchDIVER", 13031, GLOVE_GONE

    @staticmethod
    def ask(host: str, port: int) -> str | None:
        """Return in words what the program says of its gloves."""
        with socket.create_connection((host, port), ASK_S) as connection:
            connection.settimeout(ASK_S)
            _send(connection, json.dumps({**STATUS, "ts": 0}))
            return state_in(connection.recv(MOST_BYTES).partition(b"~")[0].decode(errors="replace"))

    def _serve(self) -> None:
        with socket.create_connection(self._address, SEND_S) as connection:
            connection.settimeout(SEND_S)
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._converse(connection)

    def _converse(self, connection: socket.socket) -> None:
        _send(connection, "StartFromClient")
        self._has_connected()
        sent: dict[tuple[str, str], str] = {}
        answers, asked_at = b"", float("-inf")
        while True:
            wanted = self._next()
            values = messages(wanted, self._table, time.monotonic())
            _send(connection, *changes(sent, values))
            sent = values
            if wanted.is_closed:
                _send(connection, "StopFromClient")
                return
            if time.monotonic() - asked_at >= ASK_S:
                asked_at = time.monotonic()
                _send(connection, json.dumps({**STATUS, "ts": int(time.time() * 1e3)}))
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


def messages(
    wanted: Wanted, table: Mapping[str, Material], now: float
) -> dict[tuple[str, str], str]:
    """Return the values of each kind and hand; what is absent is at rest."""
    values = {}
    for number, touch in wanted.touches.items():
        hand = HANDS[number]
        force = min(touch.command.motion.force_n / FULL_FORCE_N, 1.0)
        if force > 0.0:
            values["force", hand] = f"{force:.2f}:0.0:0.0"
        index, velocity, volume = texture_of(touch, table, now)
        percent = round(100.0 * volume * wanted.gain)
        if percent > 0:
            values["texture", hand] = f"{index}:0.5:0.0:{velocity:.2f}:{percent}.0"
    temperature = round(min(max(0.5 + (wanted.setpoint_c - NEUTRAL_C) / SPAN_C, 0.0), 1.0), 2)
    if temperature != 0.5:
        values["temperature", HANDS[wanted.latest]] = f"{temperature:.2f}"
    return values


def texture_of(touch: Touch, table: Mapping[str, Material], now: float) -> tuple[int, float, float]:
    """Return index, velocity (m/s) and volume (0..1) of a hand's texture, 0 at rest."""
    command, onset = touch.command, touch.onset
    if command.material is None or command.material not in table:
        return CLICK, 0.0, 0.0
    material = table[command.material]
    kind = material.name if material.like is None else material.like
    if onset is not None and now < touch.began_at + CLICK_S:
        loud = onset.gain * min(onset.motion.speed_mps / LOUDEST_MPS, 1.0)
        return SOFT_CLICK if kind in SOFT else CLICK, FASTEST, loud
    speed = command.motion.speed_mps
    if command.interaction in IMPACTS or speed <= 0.0 or kind not in TEXTURES:
        return CLICK, 0.0, 0.0
    loud = command.gain * (0.3 + 0.7 * material.vibration.roughness)
    return TEXTURES[kind], min(speed, FASTEST), loud


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
