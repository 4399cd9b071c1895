"""Shares memory between gateway and audio engine without a lock: orders go in, a status comes out.

The gateway is the only writer of orders and of the persistent state, and the engine their only
reader. For the status, the delays and the samples it is the other way round. Each part of the
memory therefore has one writer, and no lock is needed. A lock would be wrong here: a gateway that
is preempted while it holds one would silence the speaker.

Memory ordering. Every record begins with its own number and ends in a checksum. The writer stores
the record first and the number of the newest record last, at the start of the memory. A reader that
sees the new number therefore expects a complete record. A processor such as ARM may still show the
two stores in the other order, and a writer may be suspended between them; then the record's number
or checksum does not fit, and the reader leaves the record for its next block, 2.7 ms later. So a
half-written record is never acted on, on any processor.

Statuses and persistent states alternate between two slots, since `pack_into` clears its target
first: a writer that is suspended in the middle of a write leaves the record before it intact.

If the engine is late or dead, the gateway does not wait: the oldest orders are overwritten. A
reader that falls a whole ring behind counts the orders it lost. If the gateway dies, the leases of
the last orders end in the engine.
"""

from __future__ import annotations

import ctypes
import multiprocessing
import struct
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hapticvlm.materials import MATERIALS
from hapticvlm.rendering.vibration.hum import Hum
from hapticvlm.rendering.vibration.vibration import INTERACTIONS, Motion
from hapticvlm.rendering.vibration.voices import Command

if TYPE_CHECKING:
    Shared = ctypes.Array[ctypes.c_ubyte]

SLOTS = 256
DELAYS = 1024  # newest orders whose delay is kept
SAMPLES = 48_000  # the newest second
MAX_READ_ATTEMPTS = 100
# Layout of the memory, from its start:
#   three numbers of 8 bytes: of the newest order, the newest status, the newest persistent state
#   two slots for a status, DELAYS delays, a second of samples
#   SLOTS records of orders, then two slots for the persistent state
_RECORD = struct.Struct("<QBBBBhxxffffdQfffd")
_STATUS = struct.Struct("<QdfQQQQQ??")
_PERSISTENT = struct.Struct("<QdQ")
_SUM = struct.Struct("<I")
_NUMBER = struct.Struct("<Q")
_NEWEST = 0
_NEWEST_STATUS = 8
_NEWEST_PERSISTENT = 16
_STATUS_AT = 64
_STATUS_SIZE = 80
_RECORD_SIZE = 80
_DELAYS_AT = _STATUS_AT + 2 * _STATUS_SIZE
_SAMPLES_AT = _DELAYS_AT + 4 * DELAYS
_RING_AT = _SAMPLES_AT + 4 * SAMPLES
_PERSISTENT_AT = _RING_AT + SLOTS * _RECORD_SIZE
_PERSISTENT_SIZE = 64
_SIZE = _PERSISTENT_AT + 2 * _PERSISTENT_SIZE
_COMMAND = 1
_RELEASE = 2
_REST = 3
_NOTHING = (0.0, 0.0, 0.0, 0.0, 0.0, 0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Release:
    """Order to fade one hand: 0 is the left, 1 the right one."""

    hand: int


@dataclass(frozen=True, slots=True)
class RestAll:
    """Order to fade everything."""


@dataclass(frozen=True, slots=True)
class PersistentState:
    """State that holds until it is changed, even if orders are lost; only the newest counts.

    `gain` is 0..1; `rested` is the number of the newest order to rest everything, 0 for none.
    """

    # Orders may be lost, because a gateway that outruns a stopped engine overwrites the oldest. For
    # an impact that is right: a late one is worse than none. A gain or a stop must not be lost. So
    # both are stored beside the ring, and the engine compares them with what it has carried out.
    gain: float
    rested: int


Order = Command | Release | RestAll


@dataclass(frozen=True, slots=True)
class EngineStatus:
    """Report of the engine for each block; times are seconds on the monotonic clock.

    `level` is the rms of the block, 0..1. `lost` counts overwritten orders, `scrubbed` blocks and
    voices that were dropped because they were not finite, `samples` those ever played. `newest` is
    the number of the newest order carried out.
    """

    beat_at: float
    level: float
    underruns: int
    lost: int
    scrubbed: int
    samples: int
    newest: int
    realtime: bool
    has_output: bool = True


_UNREPORTED = EngineStatus(0.0, 0.0, 0, 0, 0, 0, 0, realtime=False)


class Ring:
    """The view of the shared memory that both ends use.

    A material travels as its index in `materials`, so both ends must be given the same names.
    """

    def __init__(self, shared: Shared, materials: Sequence[str] = tuple(MATERIALS)) -> None:
        self._shared = shared
        self._materials = tuple(materials)
        self._view = np.frombuffer(memoryview(shared), np.uint8).data
        self._delays = np.frombuffer(memoryview(shared), np.float32, DELAYS, _DELAYS_AT)
        self._samples = np.frombuffer(memoryview(shared), np.float32, SAMPLES, _SAMPLES_AT)
        self._status = _UNREPORTED

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
        """Number of the newest order written; 0 for none."""
        return self._number(_NEWEST)

    @property
    def numbers(self) -> tuple[int, int]:
        """Numbers of the newest order and of the newest persistent state written."""
        return self._number(_NEWEST), self._number(_NEWEST_PERSISTENT)

    def put(self, order: Order, now: float) -> int:
        """Write one order (gateway side) and return its number.

        Never waits: if the engine is late or dead, old records are overwritten. A late engine then
        counts the orders it lost; a new engine begins after them.
        """
        number = self.newest + 1
        fields = _fields(order, self._materials)
        self._write(_RECORD.pack(number, *fields, now), _record_at(number))
        # The record is stored first and its number last (memory ordering: see the head of the
        # file). There is no barrier between the two stores; the checksum makes up for it.
        self._view[_NEWEST : _NEWEST + 8] = _NUMBER.pack(number)
        return number

    def set_persistent(self, state: PersistentState) -> None:
        """Replace the persistent state (gateway side)."""
        number = self._number(_NEWEST_PERSISTENT) + 1
        self._write(_PERSISTENT.pack(number, state.gain, state.rested), _persistent_at(number))
        self._view[_NEWEST_PERSISTENT : _NEWEST_PERSISTENT + 8] = _NUMBER.pack(number)

    def persistent(self) -> PersistentState | None:
        """Return the persistent state, or None while there is no complete one (engine side)."""
        number = self._number(_NEWEST_PERSISTENT)
        fields = self._read(_PERSISTENT, _persistent_at(number)) if number else None
        if fields is None or fields[0] != number:
            return None
        return PersistentState(fields[1], fields[2])

    def take(self, after: int) -> Iterator[tuple[int, float, Order | None]]:
        """Yield (number, written_at, order) of the orders after number `after` (engine side).

        `written_at` is in s on the monotonic clock; an order that was lost is None.
        """
        newest = self.newest
        for number in range(after + 1, newest + 1):
            # The writer may be about to overwrite the oldest slot with the next order, so a record
            # is trusted only if it lies less than a whole ring behind.
            if newest - number >= SLOTS - 1:
                yield number, 0.0, None
                continue
            record = self._read(_RECORD, _record_at(number))
            if record is None or record[0] != number:
                # The record is not complete yet. The orders after it are newer and must not
                # overtake it, so the next block continues from this record.
                return
            yield number, record[-1], _order(record[1:-1], self._materials)

    def report(self, status: EngineStatus, block: NDArray[np.float32]) -> None:
        """Publish a status and the newest block of samples, (N,) float32 (engine side)."""
        at = (status.samples - block.size) % SAMPLES
        to_the_edge = min(block.size, SAMPLES - at)
        self._samples[at : at + to_the_edge] = block[:to_the_edge]
        self._samples[: block.size - to_the_edge] = block[to_the_edge:]
        number = self._number(_NEWEST_STATUS) + 1
        data = _STATUS.pack(
            number,
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
        self._write(data, _status_at(number))
        self._view[_NEWEST_STATUS : _NEWEST_STATUS + 8] = _NUMBER.pack(number)

    def note_delay(self, number: int, delay_s: float) -> None:
        """Record the time in s that order `number` waited for its first block (engine side)."""
        self._delays[number % DELAYS] = delay_s

    def status(self) -> EngineStatus:
        """Read the engine's newest status (gateway side)."""
        # The engine writes each status into the other of two slots. A slot that is being read can
        # only be overwritten by the status after the next; then the checksum or the number does not
        # fit, and the next attempt reads the newer one. If the engine died in the middle of a
        # write, the last complete status stays.
        for _ in range(MAX_READ_ATTEMPTS):
            number = self._number(_NEWEST_STATUS)
            fields = self._read(_STATUS, _status_at(number)) if number else None
            is_announced = fields is not None and fields[0] == number
            if fields is not None and is_announced:
                self._status = EngineStatus(*fields[1:])
            if is_announced or not number:
                break
        return self._status

    def delays(self, first: int, last: int) -> NDArray[np.float32]:
        """Return the delays in s of the orders first..last, (N,); at most the newest DELAYS."""
        numbers = np.arange(max(first, last - DELAYS + 1), last + 1)
        return np.array(self._delays[numbers % DELAYS])

    def waveform(self, count: int) -> NDArray[np.float32]:
        """Return the newest `count` (<= SAMPLES) samples played, (count,)."""
        return self.waveform_until(count)[1]

    def waveform_until(self, count: int) -> tuple[int, NDArray[np.float32]]:
        """Return the number of samples played since the start, and the newest `count` of them."""
        end = self.status().samples
        at = (end - count) % SAMPLES
        to_the_edge = self._samples[at : at + count]
        return end, np.concatenate((to_the_edge, self._samples[: count - to_the_edge.size]))

    def _number(self, at: int) -> int:
        number: int = _NUMBER.unpack_from(self._view, at)[0]
        return number

    def _write(self, data: bytes, at: int) -> None:
        self._view[at : at + len(data)] = data
        _SUM.pack_into(self._view, at + len(data), zlib.crc32(data))

    def _read(self, form: struct.Struct, at: int) -> tuple[Any, ...] | None:
        """Return the fields at this offset; None if the record is not complete."""
        end = at + form.size
        data = bytes(self._view[at:end])
        is_whole = zlib.crc32(data) == _SUM.unpack_from(self._view, end)[0]
        return form.unpack(data) if is_whole else None


def _record_at(number: int) -> int:
    return _RING_AT + number % SLOTS * _RECORD_SIZE


def _persistent_at(number: int) -> int:
    return _PERSISTENT_AT + number % 2 * _PERSISTENT_SIZE


def _status_at(number: int) -> int:
    return _STATUS_AT + number % 2 * _STATUS_SIZE


def _fields(order: Order, materials: tuple[str, ...]) -> tuple[int | float, ...]:
    match order:
        case Command():
            material = -1 if order.material is None else materials.index(order.material)
            interaction = INTERACTIONS.index(order.interaction)
            motion = order.motion
            thickness_m = order.thickness_m or 0.0
            return (
                *(_COMMAND, order.hand, interaction, order.onset, material),
                *(motion.speed_mps, motion.force_n, order.gain, thickness_m),
                *(order.expires_at, order.seed, *_hum_fields(order.hum)),
            )
        case Release():
            return _RELEASE, order.hand, 0, 0, -1, *_NOTHING
        case RestAll():
            return _REST, 0, 0, 0, -1, *_NOTHING


def _order(fields: tuple[Any, ...], materials: tuple[str, ...]) -> Order:
    kind, hand, interaction, onset, material, *numbers = fields
    if kind == _RELEASE:
        return Release(hand)
    if kind == _REST:
        return RestAll()
    speed, force, gain, thick, expires_at, seed, *hum = numbers
    return Command(
        hand=hand,
        material=None if material < 0 else materials[material],
        interaction=INTERACTIONS[interaction],
        onset=bool(onset),
        motion=Motion(speed, force),
        seed=seed,
        expires_at=expires_at,
        gain=gain,
        thickness_m=thick or None,
        hum=Hum(*hum) if hum[0] else None,
    )


def _hum_fields(hum: Hum | None) -> tuple[float, float, float]:
    return (0.0, 0.0, 0.0) if hum is None else (hum.frequency_hz, hum.level, hum.richness)
