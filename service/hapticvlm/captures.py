"""The one capture format, read and written: a folder with capture.jsonl and pictures, or a video.

A line of capture.jsonl is one protocol message without its id, plus `t_s` (when it was sent),
`file` and `mask_file` (its pictures) and `truth` (what is touched or shown, for evaluation only).
A video file is its frames at their own times; a .jsonl of the same name beside it adds the rest.
"""

from __future__ import annotations

import itertools
import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

if TYPE_CHECKING:
    import cv2

LINES = "capture.jsonl"
VIDEO_SUFFIXES = frozenset({".mp4", ".mkv", ".webm", ".mov", ".avi"})
JPEG_QUALITY = 80
_EXTRAS = ("t_s", "type", "file", "mask_file", "truth")


class CaptureError(Exception):
    """A capture that cannot be read: which file, which line, what to do."""


@dataclass(frozen=True, slots=True)
class Line:
    """One message of a capture; `fields` are the protocol's own, without type and id."""

    t_s: float
    type: str
    fields: dict[str, Any]
    file: Path | None = None
    mask_file: Path | None = None
    truth: str | None = None
    image: bytes | None = None

    def message(self, *, with_mask: bool = True) -> dict[str, Any]:
        """Return the protocol message's fields, pictures read from their files.

        A frame may carry a mask or a region, not both; the mask is taken where there is one.
        """
        fields = dict(self.fields)
        image = self.image if self.file is None else self.file.read_bytes()
        if image is not None:
            fields["image"] = image
        if self.mask_file is not None and with_mask:
            fields["mask"] = self.mask_file.read_bytes()
            fields.pop("region", None)
        return fields


@dataclass(frozen=True, slots=True)
class Capture:
    """A recorded session: how long it lasts, how many frames it has, and its lines in order."""

    path: Path
    duration_s: float
    frames: int
    _lines: tuple[Line, ...] = ()
    _video: Path | None = None

    def lines(self) -> Iterator[Line]:
        """Yield the lines in time order; a video is decoded as it goes."""
        if self._video is None:
            return iter(self._lines)
        return _merged(iter(self._lines), _video_lines(self._video))


def read(path: Path) -> Capture:
    """Open a capture folder or a video. Raises CaptureError."""
    if path.is_dir():
        lines = _read_lines(path / LINES)
        frames = sum(line.type == "frame" for line in lines)
        return Capture(path, lines[-1].t_s if lines else 0.0, frames, lines)
    if path.suffix.lower() in VIDEO_SUFFIXES and path.is_file():
        sidecar = path.with_suffix(".jsonl")
        lines = _read_lines(sidecar) if sidecar.exists() else ()
        duration_s, frames = _video_size(path)
        return Capture(path, duration_s, frames, lines, path)
    raise CaptureError(
        f"{path}: neither a folder with {LINES} nor a video ({', '.join(sorted(VIDEO_SUFFIXES))})"
    )


class Recorder:
    """Writes lines of a capture or of decisions, one JSON object each, as they come."""

    def __init__(self, path: Path) -> None:
        self._file: TextIO = path.open("w", encoding="utf-8")

    def write(self, t_s: float, message: dict[str, Any], **extras: Any) -> None:
        """Append one message; pictures must have been replaced by `file` before."""
        line = {"t_s": round(t_s, 6), **message, **extras}
        self._file.write(json.dumps(line) + "\n")

    def close(self) -> None:
        """Finish the file."""
        self._file.close()


def _read_lines(path: Path) -> tuple[Line, ...]:
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise CaptureError(f"{path}: {error.strerror}") from None
    lines: list[Line] = []
    for number, row in enumerate(text.splitlines(), 1):
        if row.strip():
            lines.append(_line(row, path, number))
    for number, (before, after) in enumerate(itertools.pairwise(lines), 2):
        if after.t_s < before.t_s:
            raise CaptureError(f"{path}:{number}: t_s goes back; sort the lines by time")
    return tuple(lines)


def _line(row: str, path: Path, number: int) -> Line:
    try:
        entry = json.loads(row)
        fields = {name: value for name, value in entry.items() if name not in _EXTRAS}
        return Line(
            t_s=float(entry["t_s"]),
            type=entry["type"],
            fields=fields,
            file=_beside(path, entry.get("file")),
            mask_file=_beside(path, entry.get("mask_file")),
            truth=entry.get("truth"),
        )
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise CaptureError(f"{path}:{number}: not a capture line ({error!r})") from None


def _beside(path: Path, name: str | None) -> Path | None:
    """Resolve a picture's name, which must stay inside the capture's folder."""
    if name is None:
        return None
    picture = (path.parent / name).resolve()
    if not picture.is_relative_to(path.parent.resolve()):
        raise ValueError(f"{name} lies outside the capture")
    return picture


def _merged(lines: Iterator[Line], frames: Iterator[Line]) -> Iterator[Line]:
    waiting = next(lines, None)
    for frame in frames:
        while waiting is not None and waiting.t_s <= frame.t_s:
            yield waiting
            waiting = next(lines, None)
        yield frame
    if waiting is not None:
        yield waiting
        yield from lines


def _open_video(path: Path) -> cv2.VideoCapture:
    try:
        import cv2
    except ImportError:
        raise CaptureError(f"{path}: videos need `pip install 'hapticvlm[video]'`") from None
    video = cv2.VideoCapture(str(path))
    if not video.isOpened():
        raise CaptureError(f"{path}: not a video that OpenCV can read")
    return video


def _video_size(path: Path) -> tuple[float, int]:
    import cv2

    video = _open_video(path)
    try:
        frames = max(0, int(video.get(cv2.CAP_PROP_FRAME_COUNT)))
        rate = video.get(cv2.CAP_PROP_FPS) or 30.0
        return frames / rate, frames
    finally:
        video.release()


def _video_lines(path: Path) -> Iterator[Line]:
    import cv2

    video = _open_video(path)
    rate = video.get(cv2.CAP_PROP_FPS) or 30.0
    try:
        number = 0
        while True:
            ok, picture = video.read()
            if not ok:
                return
            height, width = picture.shape[:2]
            _, jpeg = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
            t_s = number / rate
            fields = {
                "captured_at": t_s,
                "format": "jpeg",
                "width": width,
                "height": height,
                "origin": "top",
            }
            yield Line(t_s, "frame", fields, image=jpeg.tobytes())
            number += 1
    finally:
        video.release()
