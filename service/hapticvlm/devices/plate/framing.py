"""Frames on a serial line: COBS, CRC-16, and a cutter of any bytes into frames. Pure.

A frame is COBS(type, seq, payload, CRC-16/CCITT-FALSE, little endian) between two zeros
(`firmware/PROTOCOL.md`). COBS removes every zero, so a zero ends a frame and nothing else does; the
first one ends whatever noise began, so that noise costs no frame.
Knows no message.
"""

from __future__ import annotations

import binascii
from dataclasses import dataclass

MAX_PAYLOAD = 48
MAX_WIRE = 2 + MAX_PAYLOAD + 2 + 2  # with type, seq, CRC, the COBS code byte and the ending zero

_CRC_START = 0xFFFF
_CRC_BYTES = 2
_HEAD_BYTES = 2
_LONGEST_BLOCK = 0xFF - 1  # bytes that one code byte can count


@dataclass(frozen=True, slots=True)
class Frame:
    """Type, sequence number (both 0..255) and payload; as received, it passed its CRC."""

    kind: int
    seq: int
    payload: bytes


def frame(content: Frame) -> bytes:
    """Write type, seq and payload as one frame between two zeros."""
    raw = bytes((content.kind, content.seq)) + content.payload
    checked = raw + binascii.crc_hqx(raw, _CRC_START).to_bytes(_CRC_BYTES, "little")
    return b"\0" + stuff(checked) + b"\0"


def stuff(raw: bytes) -> bytes:
    """Remove every zero by COBS: each code byte counts the bytes up to the next zero."""
    stuffed = bytearray()
    for part in raw.split(b"\0"):
        left = part
        while len(left) >= _LONGEST_BLOCK:
            stuffed += b"\xff" + left[:_LONGEST_BLOCK]
            left = left[_LONGEST_BLOCK:]
        stuffed += bytes((len(left) + 1,)) + left
    return bytes(stuffed)


def unstuff(stuffed: bytes) -> bytes | None:
    """Undo `stuff`; None for what COBS cannot have written."""
    raw = bytearray()
    at = 0
    while at < len(stuffed):
        code = stuffed[at]
        block = stuffed[at + 1 : at + code]
        if code == 0 or len(block) != code - 1 or 0 in block:
            return None
        raw += block
        at += code
        if code <= _LONGEST_BLOCK and at < len(stuffed):
            raw.append(0)
    return bytes(raw)


class Deframer:
    """Cuts a stream of any bytes into frames; what is none is dropped and counted in `bad`."""

    def __init__(self) -> None:
        self.bad = 0
        self._pending = bytearray()
        self._is_too_long = False

    def feed(self, data: bytes) -> list[Frame]:
        """Add bytes as they come; return the frames they end. Keeps less than MAX_WIRE."""
        *ended, rest = data.split(b"\0")
        frames = []
        for part in ended:
            self._append(part)
            found = self._end()
            if found is not None:
                frames.append(found)
        self._append(rest)
        return frames

    def _append(self, part: bytes) -> None:
        # A line that sends anything but zeros must not fill the memory: what cannot be a frame any
        # more is dropped at once and counted when its end comes. The next zero begins a new frame,
        # so a single bad byte costs one frame and never two.
        if len(self._pending) + len(part) >= MAX_WIRE:
            self._is_too_long = True
            self._pending.clear()
        elif not self._is_too_long:
            self._pending += part

    def _end(self) -> Frame | None:
        stuffed = bytes(self._pending)
        was_too_long = self._is_too_long
        self._pending.clear()
        self._is_too_long = False
        if not stuffed and not was_too_long:
            return None
        found = None if was_too_long else _check(unstuff(stuffed))
        self.bad += found is None
        return found


def _check(raw: bytes | None) -> Frame | None:
    if raw is None or len(raw) < _HEAD_BYTES + _CRC_BYTES:
        return None
    body = raw[:-_CRC_BYTES]
    crc = raw[-_CRC_BYTES:]
    if binascii.crc_hqx(body, _CRC_START) != int.from_bytes(crc, "little"):
        return None
    return Frame(body[0], body[1], body[_HEAD_BYTES:])
