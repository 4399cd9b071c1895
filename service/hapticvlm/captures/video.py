"""Reads the frames of a video file, upright, at the times they were shown.

OpenCV (extra `video`) decodes and turns a rotated recording upright. Knows nothing about touches.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from numpy.typing import NDArray

from hapticvlm.captures.lines import CaptureError, Line
from hapticvlm.errors import installing

if TYPE_CHECKING:
    import cv2

VIDEO_SUFFIXES = frozenset({".mp4", ".mkv", ".webm", ".mov", ".avi"})
JPEG_QUALITY = 80
USUAL_RATE_HZ = 30.0  # for a file that states neither its rate nor the times of its frames
MAX_SIDE = 4096  # pixels; protocol v1's default limit
# One eye's half of a stereo picture is about square; half of a plain picture is far narrower.
NARROWEST_EYE = 0.6  # width over height

Eye = Literal["left", "right"]
Picture = NDArray[Any]  # (h, w, 3) uint8, blue first


def size(path: Path, eye: Eye | None) -> tuple[float, int]:
    """Return a video's length in seconds and its frames, as its header states. Raises CaptureError.

    The first frame is decoded and checked, so that an unreadable file is refused at once.
    """
    with _opened(path) as video:
        import cv2

        first, picture = video.read()
        if not first:
            raise CaptureError(f"{path}: no frame can be decoded; is the file complete?")
        seen(picture, eye, path)
        frames = max(1, int(video.get(cv2.CAP_PROP_FRAME_COUNT)))
        return frames / _rate(video), frames


def lines(path: Path, eye: Eye | None, fields: dict[str, Any]) -> Iterator[Line]:
    """Yield each frame as a line with these fields added, decoding one at a time."""
    with _opened(path) as video:
        rate = _rate(video)
        number = 0
        t_s = 0.0
        while True:
            is_read, picture = video.read()
            if not is_read:
                return
            t_s = _time(video, number, rate, t_s)
            yield _line(seen(picture, eye, path), t_s, fields)
            number += 1


@contextmanager
def _opened(path: Path) -> Iterator[cv2.VideoCapture]:
    refusal = f"{path}: not a video that OpenCV can read, or it has no frames"
    with opened(str(path), f"{path}: reading videos needs", refusal) as video:
        yield video


@contextmanager
def opened(
    source: int | str, needs: str, refusal: str, log_level: str = "ERROR"
) -> Iterator[cv2.VideoCapture]:
    """Open a file or a camera (a number) with OpenCV.

    Raises CaptureError: `needs` where OpenCV is missing, `refusal` where the source cannot be read.
    """
    # Our error is the only report: OpenCV reads these two when it is first used, and stays silent.
    os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")
    os.environ.setdefault("OPENCV_LOG_LEVEL", log_level)
    try:
        import cv2
    except ImportError:
        cure = installing("opencv-python-headless")
        raise CaptureError(f"{needs} OpenCV: `{cure}` (the extra `video`)") from None
    video = cv2.VideoCapture(source)
    try:
        if not video.isOpened():
            raise CaptureError(refusal)
        yield video
    finally:
        video.release()


def _rate(video: cv2.VideoCapture) -> float:
    import cv2

    rate = video.get(cv2.CAP_PROP_FPS)
    return rate if 0.0 < rate < 1000.0 else USUAL_RATE_HZ


def _time(video: cv2.VideoCapture, number: int, rate: float, before_s: float) -> float:
    """Return the time at which the last frame was shown: its own time, else by the rate.

    Screen recordings have a variable frame rate, so counting frames would drift.
    """
    import cv2

    reported_s = round(video.get(cv2.CAP_PROP_POS_MSEC) / 1000.0, 6)
    if number and reported_s <= before_s:
        return before_s + 1.0 / rate
    return max(0.0, reported_s)


def seen(picture: Picture, eye: Eye | None, path: Path | str) -> Picture:
    """Cut out one eye of two side by side, if one is named; halve a picture above MAX_SIDE.

    Raises CaptureError.
    """
    height, width = picture.shape[:2]
    if eye is not None:
        if width / 2 < NARROWEST_EYE * height:
            raise CaptureError(
                f"{path}: {width} x {height} pixels is not two eyes side by side; leave out --eye"
            )
        half = width // 2
        picture = picture[:, :half] if eye == "left" else picture[:, width - half :]
    while max(picture.shape[:2]) > MAX_SIDE:
        height, width = picture.shape[:2]
        import cv2

        half_size = (width // 2, height // 2)
        picture = cv2.resize(picture, half_size, interpolation=cv2.INTER_AREA)
    return picture


def frame_line(jpeg: bytes, picture: Picture, t_s: float, fields: dict[str, Any]) -> Line:
    """Return the line of a frame whose picture was encoded to this JPEG."""
    height, width = picture.shape[:2]
    shape = {"format": "jpeg", "width": width, "height": height, "origin": "top"}
    return Line(t_s, "frame", {"captured_at": t_s, **shape, **fields}, image=jpeg)


def _line(picture: Picture, t_s: float, fields: dict[str, Any]) -> Line:
    import cv2

    _, jpeg = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
    return frame_line(jpeg.tobytes(), picture, t_s, fields)
