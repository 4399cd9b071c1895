"""The shared memory between gateway and audio engine: a command ring one way, status the other.

One writer and one reader on each side, no lock. A record carries its sequence number first and
last, and the number of the newest record is stored after the record, so the reader never acts on a
half-written one. A reader that falls a whole ring behind counts what it lost.
"""

from __future__ import annotations

import ctypes
import multiprocessing
import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hapticvlm.materials import MATERIALS
from hapticvlm.rendering.vibration import IMPACTS, TEXTURES, Stroke
from hapticvlm.rendering.voices import Command

if TYPE_CHECKING:
    Shared = ctypes.Array[ctypes.c_ubyte]

SLOTS = 256
DELAYS = 1024
SAMPLES = 8192

_RECORD = struct.Struct("<QBBBBhxxfffdQdQ")
_STATUS = struct.Struct("<dfQQQQQ??")
_NEWEST = 0
_STATUS_AT = 64
_DELAYS_AT = _STATUS_AT + 128
_SAMPLES_AT = _DELAYS_AT + 4 * DELAYS
_RING_AT = _SAMPLES_AT + 4 * SAMPLES
_SIZE = _RING_AT + SLOTS * _RECORD.size

_INTERACTIONS = (*IMPACTS, *TEXTURES)
_OBEY, _LET_GO, _REST, _GAIN = 1, 2, 3, 4


@dataclass(frozen=True, slots=True)
class LetGo:
    """Fade one hand."""

    hand: int


@dataclass(frozen=True, slots=True)
class RestAll:
    """Fade everything."""


@dataclass(frozen=True, slots=True)
class Gain:
    """Set the vibration gain."""

    gain: float


Order = Command | LetGo | RestAll | Gain


@dataclass(frozen=True, slots=True)
class EngineStatus:
    """What the engine reports each block; times are seconds on the monotonic clock."""

    beat_at: float
    level: float
    underruns: int
    lost: int
    scrubbed: int
    samples: int
    newest: int
    realtime: bool
    has_output: bool = True


class Ring:
    """Both ends' view of one shared block of memory.

    Materials travel as places in `materials`, so both ends are made with the same names.
    """

    def __init__(self, shared: Shared, materials: Sequence[str] = tuple(MATERIALS)) -> None:
        self._shared = shared
        self._materials = tuple(materials)
        self._view = np.frombuffer(memoryview(shared), np.uint8).data
        self._delays = np.frombuffer(memoryview(shared), np.float32, DELAYS, _DELAYS_AT)
        self._samples = np.frombuffer(memoryview(shared), np.float32, SAMPLES, _SAMPLES_AT)

    @classmethod
    def create(cls, materials: Sequence[str] = tuple(MATERIALS)) -> Ring:
        """Allocate a ring that a spawned process can share."""
        return cls(multiprocessing.get_context("spawn").RawArray("B", _SIZE), materials)

    @property
    def shared(self) -> Shared:
        """The memory to hand to the child process."""
        return self._shared

    @property
    def newest(self) -> int:
        """Number of the newest command written; 0 = none."""
        return int.from_bytes(self._view[_NEWEST : _NEWEST + 8], "little")

    def put(self, order: Order, now: float) -> int:
        """Write one order (gateway side) and return its number."""
        number = self.newest + 1
        offset = _RING_AT + number % SLOTS * _RECORD.size
        fields = _fields(order, self._materials)
        _RECORD.pack_into(self._view, offset, number, *fields, now, number)
        self._view[_NEWEST : _NEWEST + 8] = number.to_bytes(8, "little")
        return number

    def take(self, after: int) -> Iterator[tuple[int, float, Order | None]]:
        """Yield (number, written_at, order) newer than `after`; order None = lost (engine side)."""
        newest = self.newest
        for number in range(after + 1, newest + 1):
            if newest - number >= SLOTS - 1:
                yield number, 0.0, None
                continue
            offset = _RING_AT + number % SLOTS * _RECORD.size
            first, *fields, written_at, last = _RECORD.unpack_from(self._view, offset)
            is_whole = first == last == number
            yield number, written_at, _order(fields, self._materials) if is_whole else None

    def report(self, status: EngineStatus, block: NDArray[np.float32]) -> None:
        """Publish status and the newest block of samples (engine side)."""
        at = (status.samples - block.size) % SAMPLES
        fits = min(block.size, SAMPLES - at)
        self._samples[at : at + fits] = block[:fits]
        self._samples[: block.size - fits] = block[fits:]
        _STATUS.pack_into(
            self._view,
            _STATUS_AT,
            status.beat_at,
            status.level,
            status.underruns,
            status.lost,
            status.scrubbed,
            status.samples,
            status.newest,
            status.realtime,
            status.has_output,
        )

    def note_delay(self, number: int, delay_s: float) -> None:
        """Keep how long command `number` waited for its first block (engine side)."""
        self._delays[number % DELAYS] = delay_s

    def status(self) -> EngineStatus:
        """Read the engine's newest status (gateway side)."""
        fields = _STATUS.unpack_from(self._view, _STATUS_AT)
        return EngineStatus(*fields)

    def delays(self, first: int, last: int) -> NDArray[np.float32]:
        """Return the delays in s of commands first..last, as far as still kept."""
        numbers = np.arange(max(first, last - DELAYS + 1), last + 1)
        return np.array(self._delays[numbers % DELAYS])

    def waveform(self, count: int) -> NDArray[np.float32]:
        """Return the newest `count` (<= SAMPLES) samples played."""
        end = self.status().samples
        return np.array(self._samples[np.arange(end - count, end) % SAMPLES])


def _fields(order: Order, materials: tuple[str, ...]) -> tuple[int | float, ...]:
    match order:
        case Command():
            material = -1 if order.material is None else materials.index(order.material)
            interaction = _INTERACTIONS.index(order.interaction)
            stroke = order.stroke
            return (
                *(_OBEY, order.hand, interaction, order.onset, material),
                *(stroke.speed_mps, stroke.force_n, 0.0, order.expires_at, order.seed),
            )
        case LetGo():
            return _LET_GO, order.hand, 0, 0, -1, 0.0, 0.0, 0.0, 0.0, 0
        case RestAll():
            return _REST, 0, 0, 0, -1, 0.0, 0.0, 0.0, 0.0, 0
        case Gain():
            return _GAIN, 0, 0, 0, -1, 0.0, 0.0, order.gain, 0.0, 0


def _order(fields: list[Any], materials: tuple[str, ...]) -> Order:
    kind, hand, interaction, onset, material, speed, force, gain, expires_at, seed = fields
    if kind == _LET_GO:
        return LetGo(hand)
    if kind == _REST:
        return RestAll()
    if kind == _GAIN:
        return Gain(gain)
    return Command(
        hand=hand,
        material=None if material < 0 else materials[material],
        interaction=_INTERACTIONS[interaction],
        onset=bool(onset),
        stroke=Stroke(speed, force),
        seed=seed,
        expires_at=expires_at,
    )
