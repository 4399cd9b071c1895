"""Drives what Intiface Central runs (controllers of many makers), by Buttplug version 4.

Messages are JSON arrays over a WebSocket, and the engine answers each by its `Id`. It lists its
devices, again whenever one comes or goes, each with features that have a range of whole numbers.
Two kinds are driven: Vibrate by the amplitude that pads and phones get (`VibrationPlanner`), that
of the stronger hand on every device, and Temperature by the plate's setpoint. Nothing else moves.
The engine stops all devices when this connection ends, or misses pings for its MaxPingTime.
"""

from __future__ import annotations

import contextlib
import json
import logging
import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from websockets.exceptions import WebSocketException
from websockets.sync.client import ClientConnection, connect

from hapticvlm.devices.faults import INTIFACE_EMPTY, INTIFACE_GONE
from hapticvlm.devices.speaker import table_cache
from hapticvlm.devices.speaker.engine import AudioSettings
from hapticvlm.devices.worn.output import Touch, Wanted, WornOutput
from hapticvlm.materials import Material
from hapticvlm.perception import NEUTRAL_C
from hapticvlm.rendering.heat.limits import SETPOINT_MAX_C, SETPOINT_MIN_C
from hapticvlm.rendering.vibration.cache import CACHE
from hapticvlm.rendering.vibration.patterns import Pattern
from hapticvlm.rendering.vibration.vibration_plan import PERIOD_S, VibrationPlanner
from hapticvlm.rendering.vibration.voices import Command

VERSION = 4
VIBRATE, TEMPERATURE = "Vibrate", "Temperature"
PLAN_S = 0.05  # between plans: radios take some 20 values a second
ANSWER_S = 2.0  # an engine that leaves a message unanswered for longer is gone
SCAN_S = 10.0  # between searches, while there is nothing to drive
OPEN_S = 1.0

Key = tuple[int, int, str]  # device, feature, kind
Message = tuple[str, dict[str, Any]]
_STOP: Message = ("StopCmd", {"Inputs": False, "Outputs": True})
logger = logging.getLogger(__name__)


@dataclass(slots=True)
class Engine:
    """One conversation with an engine: its devices, and what each was told last. Pure."""

    name: str | None = None  # until it has greeted
    ping_s: float | None = None
    ranges: dict[Key, tuple[int, int]] = field(default_factory=dict)
    devices: dict[int, str] = field(default_factory=dict)
    must_scan: bool = True
    _told: dict[Key, int] = field(default_factory=dict)
    _asked: dict[int, float] = field(default_factory=dict)  # when each unanswered message was sent
    _last_id: int = 0
    _scanned_at: float = float("-inf")
    _pinged_at: float = float("-inf")

    def greeting(self, now: float) -> str:
        """Return the first message."""
        version = {"ProtocolVersionMajor": VERSION, "ProtocolVersionMinor": 0}
        return self._ask([("RequestServerInfo", {"ClientName": "HapticVLM", **version})], now)

    def receive(self, text: str | bytes, now: float) -> str | None:
        """Take the answers and events of one message; return what is to be asked then, if anything.

        Raises ValueError if it is not of this protocol.
        """
        try:
            for kind, body in (pair for each in json.loads(text) for pair in each.items()):
                self._asked.pop(body["Id"], None)
                self._take(kind, body)
                if kind == "ServerInfo":
                    return self._ask([_STOP, ("RequestDeviceList", {})], now)
        except (AttributeError, LookupError, TypeError, ArithmeticError, RecursionError) as error:
            raise ValueError(f"not a message of Buttplug: {error!r}") from error
        return None

    def _take(self, kind: str, body: Mapping[str, Any]) -> None:
        if kind == "ServerInfo":
            if body["ProtocolVersionMajor"] != VERSION:
                raise ValueError(f"speaks version {body['ProtocolVersionMajor']}, not {VERSION}")
            self.name = str(body["ServerName"])
            self.ping_s = body["MaxPingTime"] / 1000.0 or None
        elif kind == "DeviceList":
            self._list(body["Devices"].values())
        elif kind == "Error" and self.name is None:
            raise ValueError(f"update Intiface Central, it refuses version {VERSION}")
        elif kind == "Error":
            logger.info("Intiface refused a message: %s", body["ErrorMessage"])

    def _list(self, devices: Iterable[Mapping[str, Any]]) -> None:
        before = set(self.devices)
        self.devices, self.ranges = {}, {}
        for device in devices:
            index = int(device["DeviceIndex"])
            for feature in device["DeviceFeatures"].values():
                for kind, limits in (feature.get("Output") or {}).items():
                    if kind in (VIBRATE, TEMPERATURE):
                        low, high = map(int, limits["Value"])
                        self.ranges[index, int(feature["FeatureIndex"]), kind] = low, high
                        self.devices[index] = str(device["DeviceName"])
        self.must_scan |= not before <= set(self.devices)
        self._told = {key: value for key, value in self._told.items() if key in self.ranges}

    def drive(self, level: float, warmth: float, now: float) -> str | None:
        """Return what brings all devices to this level (0..1) and warmth (-1..1), and keeps them.

        None if nothing has to be sent. Raises ConnectionError if the engine does not answer.
        """
        if self._asked and now - next(iter(self._asked.values())) >= ANSWER_S:
            raise ConnectionError("it does not answer")
        if self.name is None:
            return None
        values = {
            key: value_of(key[2], limits, level, warmth) for key, limits in self.ranges.items()
        }
        asked: list[Message] = []
        if any(self._told.values()) and not any(values.values()):
            asked.append(_STOP)
        else:
            asked += [
                ("OutputCmd", {"DeviceIndex": device, "FeatureIndex": feature, "Command": command})
                for (device, feature, kind), value in values.items()
                if value != self._told.get((device, feature, kind), 0)
                for command in [{kind: {"Value": value}}]
            ]
        self._told = values
        asked += self._due(now)
        return self._ask(asked, now) if asked else None

    def rest(self, now: float) -> str:
        """Return what stops all devices."""
        return self._ask([_STOP], now)

    def _due(self, now: float) -> Iterable[Message]:
        if self.ping_s is not None and now - self._pinged_at >= self.ping_s / 3.0:
            self._pinged_at = now
            yield "Ping", {}
        if (self.must_scan or not self.devices) and now - self._scanned_at >= SCAN_S:
            self._scanned_at, self.must_scan = now, False
            yield "StartScanning", {}

    def _ask(self, messages: Iterable[Message], now: float) -> str:
        asked = []
        for kind, body in messages:
            self._last_id += 1
            self._asked[self._last_id] = now
            asked.append({kind: {"Id": self._last_id, **body}})
        return json.dumps(asked)


def value_of(kind: str, limits: tuple[int, int], level: float, warmth: float) -> int:
    """Return the whole number for a feature of these limits; 0 is at rest."""
    low, high = limits
    if kind == VIBRATE:
        return max(round(level * high), 1) if level > 0.0 else 0
    return round(warmth * high) if warmth > 0.0 else max(round(-warmth * low), low)


def warmth_of(setpoint_c: float) -> float:
    """Return -1..1: the plate's coldest, neutral and warmest setpoint. Our choice."""
    reach = SETPOINT_MAX_C if setpoint_c > NEUTRAL_C else SETPOINT_MIN_C
    return min((setpoint_c - NEUTRAL_C) / abs(reach - NEUTRAL_C), 1.0)


class Level:
    """The amplitude of the stronger hand, as pads get it."""

    def __init__(self, table: Mapping[str, Material], patterns: Iterable[Pattern]) -> None:
        """Fill the caches of the materials, which takes a part of a second."""
        table_cache.load(CACHE)
        self._planners = [VibrationPlanner(table, patterns) for _ in range(2)]
        self._onsets: list[Command | None] = [None, None]
        self._planned_at = float("-inf")
        self._level = 0.0

    def follow(self, wanted: Wanted, now: float) -> float:
        """Return the level, 0..1, until the next call."""
        is_new = [self._apply(hand, wanted.touches.get(hand), now) for hand in (0, 1)]
        if not wanted.touches:
            self._level = 0.0
        elif any(is_new) or now - self._planned_at >= PLAN_S:
            self._planned_at = now
            ahead = round(PLAN_S / PERIOD_S["amplitude"])
            plans = [planner.plan("amplitude", now).amplitude for planner in self._planners]
            self._level = wanted.gain * max(max(plan[:ahead], default=0.0) for plan in plans)
        return self._level

    def _apply(self, hand: int, touch: Touch | None, now: float) -> bool:
        """Give the hand's planner its command; return whether an impact or a release is new."""
        onset = None if touch is None else touch.onset
        is_new = onset is not self._onsets[hand]
        self._onsets[hand] = onset
        if touch is None:
            self._planners[hand].rest()
            return is_new
        if is_new and onset is not None:
            self._planners[hand].apply(onset, now)
        if not touch.command.onset:
            self._planners[hand].apply(touch.command, now)
        return is_new


class Intiface(WornOutput):
    """All devices of one engine that vibrate or have a temperature."""

    title, port, gone = "Intiface", 12345, INTIFACE_GONE

    def __init__(self, host: str, port: int, settings: AudioSettings) -> None:
        super().__init__(host, port, settings)
        self._level: Level | None = None  # made by the thread, so that no start waits for it
        self._engine = Engine()

    @staticmethod
    def ask(host: str, port: int) -> str | None:
        """Return in words what the engine says of itself."""
        engine = Engine()
        with _opened(host, port) as connection:
            connection.send(engine.greeting(0.0))
            engine.receive(connection.recv(OPEN_S), 0.0)
        return engine.name and f"{engine.name} answers"

    @property
    def faults(self) -> tuple[str, ...]:
        """Names of the current faults."""
        is_empty = self._is_connected and not self._engine.devices
        return (INTIFACE_EMPTY.name,) if is_empty else super().faults

    def _serve(self) -> None:
        try:
            with _opened(*self._address) as connection:
                self._converse(connection)
        except WebSocketException as error:
            raise ConnectionError(str(error)) from error

    def _converse(self, connection: ClientConnection) -> None:
        level = self._level = self._level or Level(self._table, self._settings.patterns)
        engine = self._engine = Engine()
        connection.send(engine.greeting(time.monotonic()))
        while True:
            wanted = self._next()
            _exchange(connection, engine, level, wanted)
            if wanted.is_closed:
                connection.send(engine.rest(time.monotonic()))
                return
            if engine.name is not None:
                if not self._is_connected:
                    self._has_connected()
                self.state = f"connected: {', '.join(engine.devices.values()) or 'no device'}"


def _exchange(connection: ClientConnection, engine: Engine, level: Level, wanted: Wanted) -> None:
    """Send what has changed, and take the answers that are there."""
    now = time.monotonic()
    asked = [engine.drive(level.follow(wanted, now), warmth_of(wanted.setpoint_c), now)]
    with contextlib.suppress(TimeoutError):
        while True:
            asked.append(engine.receive(connection.recv(timeout=0), now))
    for text in filter(None, asked):
        connection.send(text)


def _opened(host: str, port: int) -> ClientConnection:
    url = f"ws://{host}:{port}"
    return connect(url, compression=None, proxy=None, open_timeout=OPEN_S, close_timeout=OPEN_S)
