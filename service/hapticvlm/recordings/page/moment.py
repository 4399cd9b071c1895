"""Chooses the moment of a session that a shared page opens at: time, title and picture.

Without a given time it is the strongest half second of the vibration, at which every page of a
session opens. Writes no page.
"""

from __future__ import annotations

import io
from dataclasses import dataclass

import numpy as np

from hapticvlm.recordings.timeline import Picture, Timeline
from hapticvlm.rendering.vibration.vibration import RATE_HZ

POSTER_PX = 640  # longest side: enough for a card in a chat, some 50 kB
POSTER_QUALITY = 80


@dataclass(frozen=True, slots=True)
class Moment:
    """A time (s) of a session, a title and a sentence on it, and a JPEG where a frame was kept."""

    t_s: float
    title: str
    description: str
    poster: bytes | None


def moment(timeline: Timeline, at_s: float | None = None) -> Moment:
    """Return the moment at a time, or the strongest one."""
    t_s = strongest(timeline) if at_s is None else min(max(at_s, 0.0), timeline.duration_s)
    touch = timeline.touch_at(t_s)
    decision = touch and timeline.decision_at(t_s, touch.target)
    if touch is None or not decision:
        title, description = (
            "A touch, felt by HapticVLM",
            f"A session of {timeline.duration_s:.0f} s.",
        )
    else:
        title = f"{timeline.title(touch.target)}: felt as {decision['material']}"
        contact_c = decision.get("contact_c")
        warmth = "" if contact_c is None else f", {contact_c:.0f} °C under the hand"
        description = f"{decision['confidence']:.0%} sure{warmth}. Press play to hear it."
    object_id = None if touch is None else touch.object_id
    return Moment(t_s, title, description, _poster(timeline, t_s, object_id))


def strongest(timeline: Timeline) -> float:
    """Return the middle (s) of the half second of the vibration with the most energy."""
    size = RATE_HZ // 10
    tenths = np.square(timeline.wave[: timeline.wave.size // size * size].reshape(-1, size))
    if not tenths.size:
        return 0.0
    energy = np.convolve(tenths.sum(axis=1), np.ones(5), mode="same")
    return round((int(energy.argmax()) + 0.5) * size / RATE_HZ, 2)


def _poster(timeline: Timeline, t_s: float, object_id: str | None) -> bytes | None:
    """Return the newest frame of the touched object, else the newest of all, else the first."""
    if not timeline.pictures:
        return None
    shown = [picture for picture in timeline.pictures if picture.t_s <= t_s]
    of_object = [picture for picture in shown if picture.object_id == object_id]
    return _jpeg((of_object or shown or timeline.pictures[:1])[-1])


def _jpeg(picture: Picture) -> bytes:
    from PIL import Image

    with Image.open(picture.file) as image:
        image.thumbnail((POSTER_PX, POSTER_PX))
        file = io.BytesIO()
        image.convert("RGB").save(file, "JPEG", quality=POSTER_QUALITY)
    return file.getvalue()
