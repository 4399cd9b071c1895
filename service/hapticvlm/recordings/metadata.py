"""Removes what cameras and programs write beside a picture: place, time, device, small copies.

No pixel changes. Of EXIF the orientation stays, because viewers turn a JPEG by it; colour profiles
stay, too. What follows the end of a picture goes, such as a phone's second one. A JPEG is a list of
segments, each with a marker and a size, and of scans, in which no marker occurs but restarts. Bytes
that do not follow their format stay as they are: no viewer shows them.
"""

from __future__ import annotations

import re
import struct

_MARKER = re.compile(rb"\xff+([^\x00\xff\xd0-\xd7])")  # ff 00 is a level, d0 to d7 are restarts
_START, _SCAN, _END, _EXIF, _PROFILE = b"\xd8", b"\xda", b"\xd9", b"\xe1", b"\xe2"
_NEEDED = re.compile(rb"[\xc0-\xcf\xda-\xdf\xe0\xee]")  # to decode; e0 is JFIF's, ee Adobe's
# Of EXIF an orientation of 2 to 8 in either order of bytes, and a segment with nothing else.
_TURN = re.compile(
    rb"\x01\x12\0\x03\0\0\0\x01\0([\x02-\x08])|\x12\x01\x03\0\x01\0\0\0([\x02-\x08])\0"
)
_TURNED = b"\xff\xe1\0\x22Exif\0\0MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0%b" + bytes(6)
_PNG = b"\x89PNG\r\n\x1a\n"
_NOTES = (b"eXIf", b"tEXt", b"zTXt", b"iTXt", b"tIME")


def without_metadata(form: str, data: bytes) -> bytes:
    """Return a picture in the form `jpeg` or `png` without metadata; raw pixels have none."""
    try:
        return {"jpeg": _jpeg, "png": _png}.get(form, bytes)(data)
    except (ValueError, struct.error):
        return data


def _jpeg(data: bytes) -> bytes:
    parts: list[bytes] = []
    at = 0
    while marker := _MARKER.search(data, at):
        kind = marker[1]
        if parts and parts[-1][1:2] == _SCAN:
            parts.append(data[at : marker.start()])
        at = marker.end()
        if kind in (_START, _END):
            parts.append(b"\xff" + kind)
            if kind == _END:
                return b"".join(parts)
            continue
        at += struct.unpack_from(">H", data, at)[0]
        content = data[marker.end() : at]
        if _NEEDED.match(kind) or (kind == _PROFILE and content[2:].startswith(b"ICC_PROFILE")):
            parts.append(b"\xff" + kind + content)
        elif kind == _EXIF and (turn := _TURN.search(content)):
            parts.append(_TURNED % (turn[1] or turn[2]))
    raise ValueError("no end")


def _png(data: bytes) -> bytes:
    parts = [_PNG]
    at = len(_PNG)
    while parts[-1][4:8] != b"IEND":
        size, kind = struct.unpack_from(">I4s", data, at)
        if kind not in _NOTES:
            parts.append(data[at : at + size + 12])
        at += size + 12
    return b"".join(parts)
