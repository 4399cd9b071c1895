"""How much of a frame is still to come, read from its header and from nothing else.

A picture of 40 KB arrives in many pieces. Who knows how long its frame is can read the rest at
once, and a flood of short frames is still read in small pieces. Knows no opcode and no payload.
"""

from __future__ import annotations

MASK_BYTES = 4
# The first length byte says how the length is written: 0..125 is it, 126 and 127 announce it.
_TWO_BYTES = 126
_EIGHT_BYTES = 127


class FrameLengths:
    """Follows the frames of one stream (RFC 6455, section 5.2)."""

    def __init__(self) -> None:
        self.missing = 0  # bytes of the frame under way, once its header is there
        self._header = b""  # a header that was cut off

    def follow(self, data: bytes) -> None:
        """Take the next bytes of the stream."""
        if self._header:
            data = self._header + data
            self._header = b""
        size = len(data)
        at = self.missing
        while at < size:
            length = _frame_bytes(data, at)
            if length is None:
                self._header = data[at:]
                at = size
                break
            at += length
        self.missing = at - size


def _frame_bytes(data: bytes, at: int) -> int | None:
    """Return the length of the frame that begins there, header and all; None: not all there."""
    if len(data) < at + 2:
        return None
    masks = MASK_BYTES if data[at + 1] & 0x80 else 0
    short = data[at + 1] & 0x7F
    if short < _TWO_BYTES:
        return 2 + masks + short
    width = 2 if short == _TWO_BYTES else 8
    if len(data) < at + 2 + width:
        return None
    return 2 + width + masks + int.from_bytes(data[at + 2 : at + 2 + width], "big")
