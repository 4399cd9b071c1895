"""Runs an output that people own beside speaker and plate: leases, stop, connection, faults.

The service commands it from its loop and never waits for it: a command is kept here. A thread of
the output connects to the maker's program, again and again, and sends what has changed. What the
program misses while it is away is not sent later. A lease ends here, for every output: what it
covers is left out of what the thread is given from then on.
"""

from __future__ import annotations

import logging
import threading
import time
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import ClassVar

from hapticvlm.devices.faults import Fault
from hapticvlm.devices.speaker.engine import AudioSettings
from hapticvlm.errors import network_reason
from hapticvlm.perception import NEUTRAL_C
from hapticvlm.rendering.vibration.voices import Command

AGAIN_S = 1.0  # between attempts to connect
TICK_S = 0.02
CLOSE_S = 2.0

logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Touch:
    """The newest command of a hand, and the onset that it follows."""

    command: Command
    onset: Command | None
    began_at: float


@dataclass(frozen=True, slots=True)
class Wanted:
    """What the hands (0 left, 1 right) are to feel now; heat is for the latest hand."""

    touches: Mapping[int, Touch] = field(default_factory=dict)
    setpoint_c: float = NEUTRAL_C
    latest: int = 1
    gain: float = 1.0
    is_closed: bool = False


class WornOutput(ABC):
    """One output; call `start`, then command it from one thread. Only `close` blocks."""

    title: ClassVar[str]
    port: ClassVar[int]
    gone: ClassVar[Fault]  # while the program does not answer

    def __init__(self, host: str, port: int, settings: AudioSettings) -> None:
        """Use the materials and recordings that the speaker renders."""
        self.name = f"{self.title} at {host}:{port}"
        self.state = "not connected"
        self._address = (host, port)
        self._settings = settings
        self._table = {material.name: material for material in settings.materials}
        self._wanted = Wanted()
        self._warm_until = 0.0
        self._changed = threading.Condition()
        self._is_connected = False
        self._thread = threading.Thread(target=self._run, name=self.title, daemon=True)

    @staticmethod
    @abstractmethod
    def ask(host: str, port: int) -> str | None:
        """Return in words what the program there says of itself; None if it is another one."""

    @abstractmethod
    def _serve(self) -> None:
        """Connect, and send what `_next` returns until it is closed, then rest.

        Raises OSError or ValueError when the program is gone or talks nonsense.
        """

    @property
    def faults(self) -> tuple[str, ...]:
        """Names of the current faults."""
        return () if self._is_connected else (self.gone.name,)

    def start(self) -> None:
        """Begin to look for the maker's program; it may be started later."""
        self._thread.start()

    def play(self, command: Command) -> None:
        """Render this motion of one hand until its lease ends."""
        hand, now = command.hand, time.monotonic()
        old = alive(self._wanted, 0.0, now).touches.get(hand)
        touch = Touch(command, command if command.onset else None, now)
        if old is not None and not command.onset:
            touch = replace(old, command=command)
        self._want(touches={**self._wanted.touches, hand: touch}, latest=hand, soon=command.onset)

    def release(self, hand: int) -> None:
        """Rest one hand."""
        others = {other: touch for other, touch in self._wanted.touches.items() if other != hand}
        self._want(touches=others)

    def set_gain(self, gain: float) -> None:
        """Scale vibration by `gain` (0..1) from now on."""
        self._want(gain=gain)

    def warm(self, setpoint_c: float, ttl_s: float) -> None:
        """Warm or cool the hand of the latest touch to `setpoint_c` for `ttl_s`."""
        self._warm_until = time.monotonic() + ttl_s
        self._want(setpoint_c=setpoint_c, soon=False)

    def rest_heat(self) -> None:
        """Return to the neutral temperature."""
        self._want(setpoint_c=NEUTRAL_C)

    def rest_vibration(self) -> None:
        """Rest forces and vibration of both hands."""
        self._want(touches={})

    def close(self) -> None:
        """Rest everything, end the connection and the thread."""
        self._want(touches={}, setpoint_c=NEUTRAL_C, is_closed=True)
        if self._thread.is_alive():
            self._thread.join(CLOSE_S)

    def _want(self, *, soon: bool = True, **changes: object) -> None:
        # The values are immutable and replaced as a whole, so the thread never sees one half set,
        # and holds the lock only to wait, never to send. What only goes on is left to its next
        # tick: a thread that wakes takes the interpreter from the loop before the touch's reply.
        with self._changed:
            if not self._wanted.is_closed:
                self._wanted = replace(self._wanted, **changes)  # type: ignore[arg-type]
            if soon:
                self._changed.notify()

    def _next(self) -> Wanted:
        """Wait for a change, a tick at most; return what is to be felt now."""
        with self._changed:
            if not self._wanted.is_closed:
                self._changed.wait(TICK_S)
            return alive(self._wanted, self._warm_until, time.monotonic())

    def _has_connected(self) -> None:
        self._is_connected, self.state = True, "connected"
        logger.warning("%s is connected", self.name)

    def _run(self) -> None:
        while not self._wanted.is_closed:
            try:
                self._serve()
                reason = "closed"
            except (OSError, ValueError) as error:
                reason = network_reason(error)
                if self._is_connected:
                    logger.warning("%s is gone: %s", self.name, reason)
            self._is_connected, self.state = False, f"not connected: {reason}"
            with self._changed:
                if not self._wanted.is_closed:
                    self._changed.wait_for(lambda: self._wanted.is_closed, AGAIN_S)


def alive(wanted: Wanted, warm_until: float, now: float) -> Wanted:
    """Return what is left of it at `now`, in s of `time.monotonic`: what a lease still covers."""
    touches = {h: touch for h, touch in wanted.touches.items() if now < touch.command.expires_at}
    return replace(
        wanted,
        touches=touches,
        setpoint_c=wanted.setpoint_c if now < warm_until else NEUTRAL_C,
    )
