"""Draws the README's moving picture from the session that `hapticvlm demo` leaves."""

from __future__ import annotations

from pathlib import Path

from PIL import Image

from hapticvlm.materials import MATERIALS
from hapticvlm.recordings import timeline
from hapticvlm.recordings.timeline import Timeline
from hapticvlm.rendering.vibration.voices import Voices
from hapticvlm_lab.bench.pictures import film

RATE_HZ = 8
SIZE = (768, 432)
QUALITY = 55
TITLE = ("HapticVLM", "virtual objects that feel like what they look like")
END = ("make demo", "the same session on your machine; no hardware needed")
TITLE_MS = 1000
END_MS = 2000
LARGEST_BYTES = 3_000_000  # a README is read on telephones too


def write(session: Path, out: Path) -> None:
    """Draw a recorded session as an animated WebP that begins anew at its end."""
    what = timeline.read(session, MATERIALS, Voices())
    whole = [film.card(_opening(what), *TITLE)]
    whole += [*film.pictures(what, RATE_HZ)]
    whole.append(film.card(whole[-1], *END))
    first, *others = (picture.resize(SIZE, Image.Resampling.LANCZOS) for picture in whole)
    each_ms = round(1000 / RATE_HZ)
    first.save(
        out,
        save_all=True,
        append_images=others,
        duration=[TITLE_MS, *(each_ms for _ in others[:-1]), END_MS],
        loop=0,
        quality=QUALITY,
        method=4,
    )
    _refuse_large(out)


def _opening(what: Timeline) -> Image.Image:
    """Draw the middle of the first touch: what a chat shows before anybody plays it."""
    at_s = what.duration_s / 2.0
    if what.touches:
        first = what.touches[0]
        at_s = (first.from_s + first.to_s) / 2.0
    return film.picture(what, at_s)


def _refuse_large(out: Path) -> None:
    size = out.stat().st_size
    if size > LARGEST_BYTES:
        raise SystemExit(f"{out}: {size / 1e6:.1f} MB: lower QUALITY, SIZE or RATE_HZ")
