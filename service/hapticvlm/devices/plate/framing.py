"""Frames the messages of a serial line with COBS and CRC-16, and finds frames in any bytes. Pure.

A frame is COBS(type, seq, payload, CRC-16/CCITT-FALSE, little endian) between two zero bytes
(`firmware/PROTOCOL.md`). COBS (consistent overhead byte stuffing) rewrites the content so that it
holds no zero byte, at the cost of one byte in 254. A zero therefore always marks the end of a
frame, and a reader that starts in the middle of one is in step again at the next zero. The zero
before the frame ends whatever noise the line picked up while it was idle, so that noise does not
destroy the frame behind it. The CRC detects what noise changes within a frame.

This module does not know what a frame means.
"""

from __future__ import annotations

import binascii
from dataclasses import dataclass

MAX_PAYLOAD = 48
MAX_WIRE = 2 + MAX_PAYLOAD + 2 + 2  # with type, seq, CRC, the COBS code byte and the ending zero

_CRC_START = 0xFFFF
_CRC_BYTES = 2
_HEAD_BYTES = 2
_MAX_BLOCK = 0xFF - 1  # bytes that one code byte can count


@dataclass(frozen=True, slots=True)
class Frame:
    """Type and sequence number (both 0..255) and payload; a received one has passed its CRC."""

    kind: int
    seq: int
    payload: bytes


def frame(content: Frame) -> bytes:
    """Encode type, seq and payload as one frame between two zeros."""
    raw = bytes((content.kind, content.seq)) + content.payload
    checked = raw + binascii.crc_hqx(raw, _CRC_START).to_bytes(_CRC_BYTES, "little")
    return b"\0" + stuff(checked) + b"\0"


def stuff(raw: bytes) -> bytes:
    """Remove every zero by COBS: each code byte counts the bytes up to the next zero."""
    stuffed = bytearray()
    for part in raw.split(b"\0"):
        rest = part
        while len(rest) >= _MAX_BLOCK:
            stuffed += b"\xff" + rest[:_MAX_BLOCK]
            rest = rest[_MAX_BLOCK:]
        stuffed += bytes((len(rest) + 1,)) + rest
    return bytes(stuffed)


def unstuff(stuffed: bytes) -> bytes | None:
    """Undo `stuff`; return None for bytes that COBS cannot produce."""
    raw = bytearray()
    at = 0
    while at < len(stuffed):
        code = stuffed[at]
        block = stuffed[at + 1 : at + code]
        if code == 0 or len(block) != code - 1 or 0 in block:
            return None
        raw += block
        at += code
        if code <= _MAX_BLOCK and at < len(stuffed):
            raw.append(0)
    return bytes(raw)


class Deframer:
    """Cuts a stream of any bytes into frames; anything else is dropped and counted in `bad`."""

    def __init__(self) -> None:
        self.bad = 0
        self._pending = bytearray()
        self._is_too_long = False

    def feed(self, data: bytes) -> list[Frame]:
        """Add received bytes and return the frames they complete; buffers less than MAX_WIRE."""
        *ended, rest = data.split(b"\0")
        frames = []
        for part in ended:
            self._append(part)
            received = self._end()
            if received is not None:
                frames.append(received)
        self._append(rest)
        return frames

    def _append(self, part: bytes) -> None:
        # A line that never sends a zero must not fill the memory. Bytes that are too many for a
        # frame are dropped at once and counted when their end comes. The next zero starts a new
        # frame, so a single bad byte costs one frame and never two.
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
        received = None if was_too_long else _check(unstuff(stuffed))
        self.bad += received is None
        return received


def _check(raw: bytes | None) -> Frame | None:
    if raw is None or len(raw) < _HEAD_BYTES + _CRC_BYTES:
        return None
    body = raw[:-_CRC_BYTES]
    crc = raw[-_CRC_BYTES:]
    if binascii.crc_hqx(body, _CRC_START) != int.from_bytes(crc, "little"):
        return None
    return Frame(body[0], body[1], body[_HEAD_BYTES:])
