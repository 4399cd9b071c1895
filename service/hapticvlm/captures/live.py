"""Reads the live pictures of a screen or a camera, such as a headset's mirror.

A live source ends when it is closed, never by itself. Knows nothing about touches.
"""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hapticvlm.captures.lines import CaptureError, Line
from hapticvlm.captures.video import JPEG_QUALITY, Eye, Picture, frame_line, opened, seen
from hapticvlm.errors import installing

PERIOD_S = 0.1  # ten pictures a second: a decision takes longer than that
LONGEST_PX = 2048  # longest side sent: the encoder gains nothing from more
SMALL = 24  # px a side of the copy that is compared
CHANGED = 2.0  # mean difference in grey levels: less is a camera's noise, or a clock in a corner

Grab = Callable[[], Picture | None]  # takes the present picture; None: the source has ended
Source = Callable[[], AbstractContextManager[Grab]]


@dataclass(frozen=True, slots=True)
class Live:
    """A source of pictures until it is closed; `name` is for messages."""

    name: str
    source: Source
    eye: Eye | None = None
    _closed: threading.Event = field(default_factory=threading.Event)

    def close(self) -> None:
        """End the pictures; from any thread."""
        self._closed.set()

    def lines(self, fields: dict[str, Any]) -> Iterator[Line]:
        """Yield a frame whenever the picture has changed. Raises CaptureError.

        The caller may ask for each line from another thread, but Windows gives a screen to one
        thread only. Therefore one thread of this method opens the source and takes every picture.
        """
        began = time.monotonic()
        before: NDArray[np.float32] | None = None
        with ThreadPoolExecutor(1) as thread, contextlib.ExitStack() as stack:
            grab = thread.submit(lambda: stack.enter_context(self.source())).result()
            while not self._closed.is_set():
                t_s = time.monotonic() - began
                picture = thread.submit(grab).result()
                if picture is None:
                    break
                copy = _small(picture)
                if before is None or float(np.abs(copy - before).mean()) > CHANGED:
                    before = copy
                    yield _line(_fitting(seen(picture, self.eye, self.name)), t_s, fields)
                self._closed.wait(max(0.0, began + t_s + PERIOD_S - time.monotonic()))
            thread.submit(stack.close).result()


@contextmanager
def screen(number: int = 1, area: tuple[int, int, int, int] | None = None) -> Iterator[Grab]:
    """Open a screen (1 is the first, 0 all) or an area of it: x, y, width, height in pixels."""
    try:
        import mss
    except ImportError:
        cure = f"`{installing('mss')}` (the extra `screen`)"
        raise CaptureError(f"reading a screen needs mss: {cure}") from None

    try:
        with mss.MSS() as screens:
            monitors = screens.monitors
            if not 0 <= number < len(monitors):
                count = len(monitors) - 1
                raise CaptureError(
                    f"screen {number} does not exist: there are {count}; --device 1 is the first"
                )
            place = dict(monitors[number])
            if area is not None:
                x, y, width, height = area
                place = {"left": place["left"] + x, "top": place["top"] + y}
                place |= {"width": width, "height": height}

            def grab() -> Picture:
                return np.asarray(screens.grab(place))[:, :, :3]

            yield grab
    except mss.ScreenShotError as error:
        cure = "run this in the desktop session of that screen; on Wayland, share it at /try"
        raise CaptureError(f"no screen can be read ({error}): {cure}") from None


@contextmanager
def camera(device: int | str) -> Iterator[Grab]:
    """Open a camera by its number, or any other source that OpenCV opens by name."""
    refusal = f"camera {device}: not found, or in use by another program; try another --device N"
    # SILENT: OpenCV prints lines of its own for every camera that is not there.
    with opened(device, "reading a camera needs", refusal, "SILENT") as video:

        def grab() -> Picture | None:
            is_read, picture = video.read()
            return picture if is_read else None

        yield grab


def _small(picture: Picture) -> NDArray[np.float32]:
    """Return a copy to compare, float32: the pixels of a grid, enough to notice a change."""
    rows = np.linspace(0, picture.shape[0] - 1, SMALL).astype(int)
    columns = np.linspace(0, picture.shape[1] - 1, SMALL).astype(int)
    copy: NDArray[np.float32] = picture[np.ix_(rows, columns)].astype(np.float32)
    return copy


def _fitting(picture: Picture) -> Picture:
    factor = -(-max(picture.shape[:2]) // LONGEST_PX)
    if factor == 1:
        return picture
    from PIL import Image

    return np.asarray(Image.fromarray(picture).reduce(factor))


def _line(picture: Picture, t_s: float, fields: dict[str, Any]) -> Line:
    import simplejpeg

    whole = np.ascontiguousarray(picture)
    jpeg = simplejpeg.encode_jpeg(whole, quality=JPEG_QUALITY, colorspace="BGR")
    return frame_line(jpeg, picture, t_s, fields)
