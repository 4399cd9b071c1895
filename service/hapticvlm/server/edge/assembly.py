"""Joins the frames of a message that came in several, and reads text as it comes.

The order of frames and the size of messages were checked before (websockets' protocol). Text that
is no UTF-8 is refused with the frame that shows it, not only at the message's end.
"""

from __future__ import annotations

import codecs

from websockets.frames import Frame, Opcode


class Assembly:
    """The message under way on one connection."""

    def __init__(self) -> None:
        self._parts = bytearray()
        self._decoder: codecs.IncrementalDecoder | None = None
        self._text: list[str] = []

    def add(self, frame: Frame) -> bytes | str | None:
        """Return the message that this part completes, or None. Raises UnicodeDecodeError."""
        if frame.opcode is Opcode.TEXT:
            self._decoder = codecs.getincrementaldecoder("utf-8")()
        if self._decoder is None:
            self._parts += frame.data
        else:
            self._text.append(self._decoder.decode(bytes(frame.data), frame.fin))
        return self._completed() if frame.fin else None

    def _completed(self) -> bytes | str:
        message: bytes | str = bytes(self._parts)
        if self._decoder is not None:
            message = "".join(self._text)
        self._parts = bytearray()
        self._decoder = None
        self._text = []
        return message
