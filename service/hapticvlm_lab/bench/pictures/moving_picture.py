"""Draws the README's moving picture from the session that `hapticvlm demo` leaves."""

from __future__ import annotations

from pathlib import Path

from PIL import Image

from hapticvlm.materials import MATERIALS
from hapticvlm.recordings import timeline
from hapticvlm.rendering.vibration.voices import Voices
from hapticvlm_lab.bench.pictures import film

RATE_HZ = 8
SIZE = (768, 432)
QUALITY = 55
LARGEST_BYTES = 3_000_000  # a README is read on telephones too


def write(session: Path, out: Path) -> None:
    """Draw a recorded session as an animated WebP that begins anew at its end."""
    what = timeline.read(session, MATERIALS, Voices())
    pictures = (
        picture.resize(SIZE, Image.Resampling.LANCZOS) for picture in film.pictures(what, RATE_HZ)
    )
    first = next(pictures)
    first.save(
        out,
        save_all=True,
        append_images=list(pictures),
        duration=round(1000 / RATE_HZ),
        loop=0,
        quality=QUALITY,
        method=4,
    )
    size = out.stat().st_size
    if size > LARGEST_BYTES:
        raise SystemExit(f"{out}: {size / 1e6:.1f} MB: lower QUALITY, SIZE or RATE_HZ")
