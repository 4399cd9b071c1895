"""A capture as a whole: its duration and its lines in time order, from a folder or a video."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from hapticvlm.captures import video
from hapticvlm.captures.lines import LINES, CaptureError, Line, read_lines
from hapticvlm.captures.live import Live
from hapticvlm.captures.video import VIDEO_SUFFIXES, Eye

CENTRE = "centre"  # id of the object in the middle of the picture
CENTRAL_SHARE = 0.4  # of width and of height, by default


@dataclass(frozen=True, slots=True)
class Touched:
    """The part touched all the time: the middle, this share (0..1) of each side of the picture."""

    share: float = CENTRAL_SHARE

    @property
    def region(self) -> dict[str, float]:
        """The region, as on the wire."""
        edge = (1.0 - self.share) / 2.0
        return {"x": edge, "y": edge, "w": self.share, "h": self.share}


@dataclass(frozen=True, slots=True)
class Capture:
    """A recorded session: its duration, its number of frames, and its lines in order.

    With `touched` no touches were recorded, and the sender touches CENTRE throughout.
    """

    path: Path
    duration_s: float
    frames: int
    touched: Touched | None = None
    _lines: tuple[Line, ...] = ()
    _video: Path | None = None
    _eye: Eye | None = None
    _live: Live | None = None

    def lines(self) -> Iterator[Line]:
        """Yield the lines in time order, decoding a video on the way. Raises CaptureError."""
        target = {"object_id": CENTRE, "region": self.touched.region} if self.touched else {}
        if self._live is not None:
            return _merged(iter(self._lines), self._live.lines(target))
        if self._video is None:
            return iter(self._lines)
        return _merged(iter(self._lines), video.lines(self._video, self._eye, target))

    def close(self) -> None:
        """End a live source; a recorded one ends by itself."""
        if self._live is not None:
            self._live.close()


def watch(live: Live, touched: Touched | None = None) -> Capture:
    """Return a capture of a screen or a camera, whose middle is touched until it is closed.

    Its duration is infinite, and its number of frames 0.
    """
    scene = {"objects": [{"object_id": CENTRE}], "replace": True}
    lines = (Line(0.0, "scene", scene),)
    return Capture(Path(live.name), math.inf, 0, touched or Touched(), lines, _live=live)


def read(path: Path, eye: Eye | None = None, touched: Touched | None = None) -> Capture:
    """Open a capture folder or a video, of which one `eye` may be used. Raises CaptureError.

    A video without a .jsonl file beside it is touched in the middle; `touched` states how large.
    """
    if path.is_dir():
        if eye or touched:
            raise CaptureError(f"{path}: --eye and --centre are for videos, and this is a folder")
        if not (path / LINES).exists():
            cure = "give a folder that `hapticvlm serve --record` wrote"
            raise CaptureError(f"{path}: holds no {LINES}; {cure}")
        lines = read_lines(path / LINES)
        frames = sum(line.type == "frame" for line in lines)
        return Capture(path, lines[-1].t_s if lines else 0.0, frames, _lines=lines)
    if path.suffix.lower() in VIDEO_SUFFIXES and path.is_file():
        return _read_video(path, eye, touched)
    if not path.exists():
        raise CaptureError(f"{path}: no such file or folder")
    raise CaptureError(
        f"{path}: neither a folder with {LINES} nor a video ({', '.join(sorted(VIDEO_SUFFIXES))})"
    )


def _read_video(path: Path, eye: Eye | None, touched: Touched | None) -> Capture:
    sidecar = path.with_suffix(".jsonl")
    if sidecar.exists() and touched is not None:
        raise CaptureError(
            f"{path}: {sidecar.name} beside it states the touches; leave out --centre"
        )
    if sidecar.exists():
        lines = read_lines(sidecar)
    else:
        touched = touched or Touched()
        scene = {"objects": [{"object_id": CENTRE}], "replace": True}
        lines = (Line(0.0, "scene", scene),)
    duration_s, frames = video.size(path, eye)
    return Capture(path, duration_s, frames, touched, lines, path, eye)


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
