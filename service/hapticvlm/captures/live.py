"""The pictures of a screen or a camera as they are shown now, such as a headset's mirror.

A live source ends when it is closed, never by itself. Knows nothing of touches.
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
from hapticvlm.captures.video import (
    AS_RECORDED,
    JPEG_QUALITY,
    Picture,
    View,
    frame_line,
    opened,
    seen,
)

LOOK_S = 0.1  # ten looks a second: a decision takes longer than that
LONGEST_PX = 2048  # of a picture as it is sent: more shows the encoder nothing
SMALL = 24  # px a side of the copy that is compared
CHANGED = 2.0  # grey levels in the mean: less is a camera's noise, or a clock in a corner

Look = Callable[[], Picture | None]  # None: the source ended
Source = Callable[[], AbstractContextManager[Look]]


@dataclass(frozen=True, slots=True)
class Live:
    """A source that can be looked at until it is closed; `name` is for messages."""

    name: str
    source: Source
    view: View = AS_RECORDED
    _closed: threading.Event = field(default_factory=threading.Event)

    def close(self) -> None:
        """End the pictures; from any thread."""
        self._closed.set()

    def lines(self, fields: dict[str, Any]) -> Iterator[Line]:
        """Yield a frame whenever the picture changed. Raises CaptureError.

        Who asks for the next line may ask from another thread each time, and Windows hands a
        screen out to one thread only. So one thread of our own opens the source and looks.
        """
        began = time.monotonic()
        before: NDArray[np.float32] | None = None
        with ThreadPoolExecutor(1) as thread, contextlib.ExitStack() as stack:
            look = thread.submit(lambda: stack.enter_context(self.source())).result()
            while not self._closed.is_set():
                t_s = time.monotonic() - began
                picture = thread.submit(look).result()
                if picture is None:
                    break
                copy = _small(picture)
                if before is None or float(np.abs(copy - before).mean()) > CHANGED:
                    before = copy
                    yield _line(_fitting(seen(picture, self.view, self.name)), t_s, fields)
                self._closed.wait(max(0.0, began + t_s + LOOK_S - time.monotonic()))
            thread.submit(stack.close).result()


@contextmanager
def screen(number: int = 1, area: tuple[int, int, int, int] | None = None) -> Iterator[Look]:
    """Offer a screen (1 is the first, 0 all) or an area of it: x, y, width, height in pixels."""
    import mss

    try:
        with mss.MSS() as screens:
            found = screens.monitors
            if not 0 <= number < len(found):
                text = f"of {len(found) - 1} that are here; --device 1 is the first"
                raise CaptureError(f"screen {number} is none {text}")
            place = dict(found[number])
            if area is not None:
                x, y, width, height = area
                place = {"left": place["left"] + x, "top": place["top"] + y}
                place |= {"width": width, "height": height}

            def look() -> Picture:
                return np.asarray(screens.grab(place))[:, :, :3]

            yield look
    except mss.ScreenShotError as error:
        cure = "run it in the desktop session whose screen it is; on Wayland, share it at /try"
        raise CaptureError(f"no screen can be read ({error}): {cure}") from None


@contextmanager
def camera(device: int | str = 0) -> Iterator[Look]:
    """Offer a camera by its number, or whatever else OpenCV opens by name."""
    refusal = f"camera {device}: none here, or another program holds it; --device 1 is the next one"
    # SILENT: OpenCV prints lines of its own for every camera that is not there.
    with opened(device, "a camera needs", refusal, "SILENT") as video:

        def look() -> Picture | None:
            shown, picture = video.read()
            return picture if shown else None

        yield look


def _small(picture: Picture) -> NDArray[np.float32]:
    """Return a copy for comparing, float32: pixels of a grid, enough to see a change."""
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
