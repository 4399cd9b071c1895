"""Compares a frame with the headers of its pictures before its session sees it.

A session is pure and knows no picture format; what reaches it has the size that it claims.
"""

from __future__ import annotations

from hapticvlm.messages import Frame, MessageError
from hapticvlm.vision.decoding import PictureError
from hapticvlm.vision.pictures import check_header


def require_header(frame: Frame) -> None:
    """Compare size, format and region with the bytes; decodes no pixel. Raises MessageError."""
    try:
        check_header(frame)
    except PictureError as error:
        raise MessageError("message", str(error), path=error.path, id=frame.id) from None
