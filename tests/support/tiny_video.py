"""Small real mp4 files: of any pictures, with uneven times, or filmed with the camera turned."""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

RATE_HZ = 10.0
TRACK = (b"moov", b"trak")
TIMES = (*TRACK, b"mdia", b"minf", b"stbl", b"stts")
MATRIX_AT = 40  # in a track header's body, nine 32-bit numbers
QUARTER_TURN = (0, 1 << 16, 0, -(1 << 16), 0, 0, 0, 0, 1 << 30)


def write(path: Path, pictures: Sequence[NDArray[np.uint8]], rate_hz: float = RATE_HZ) -> Path:
    """Write (h, w, 3) pictures, blue first, as an mp4."""
    import cv2

    height, width = pictures[0].shape[:2]
    video = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"mp4v"), rate_hz, (width, height))
    for picture in pictures:
        video.write(picture)
    video.release()
    return path


def shades(count: int, width: int = 64, height: int = 48) -> list[NDArray[np.uint8]]:
    """Grey pictures, each a little lighter than the one before."""
    return [np.full((height, width, 3), 20 + 20 * n, np.uint8) for n in range(count)]


def retime(path: Path, lasting: Sequence[float]) -> None:
    """Show each frame this many times as long as now; the sum must stay the number of frames."""

    def change(body: bytes) -> bytes:
        step = struct.unpack(">I", body[12:16])[0]
        entries = [struct.pack(">II", 1, round(step * each)) for each in lasting]
        return body[:4] + struct.pack(">I", len(entries)) + b"".join(entries)

    path.write_bytes(_rebuilt(path.read_bytes(), TIMES, change))


def turn(path: Path) -> None:
    """Say that the camera was turned: the pictures are to be shown a quarter turn clockwise."""

    def change(body: bytes) -> bytes:
        matrix = struct.pack(">9i", *QUARTER_TURN)
        return body[:MATRIX_AT] + matrix + body[MATRIX_AT + len(matrix) :]

    path.write_bytes(_rebuilt(path.read_bytes(), (*TRACK, b"tkhd"), change))


def blank(path: Path) -> None:
    """Overwrite the pictures, leaving the headers as they are."""
    path.write_bytes(_rebuilt(path.read_bytes(), (b"mdat",), lambda body: bytes(len(body))))


def _rebuilt(data: bytes, names: Sequence[bytes], change: Callable[[bytes], bytes]) -> bytes:
    """Change the body of one box; the headers stand last, so no frame moves."""
    made, at = b"", 0
    while at < len(data):
        size, name = struct.unpack_from(">I4s", data, at)
        body = data[at + 8 : at + size]
        if name == names[0]:
            body = _rebuilt(body, names[1:], change) if names[1:] else change(body)
        made += struct.pack(">I4s", len(body) + 8, name) + body
        at += size
    return made
