"""Draws the README's moving picture from the session that `hapticvlm demo` leaves.

`python -m hapticvlm_lab.bench.moving_picture` after `make demo` writes docs/demo.webp.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from PIL import Image

from hapticvlm.commands import timeline
from hapticvlm.commands.demo import film
from hapticvlm.materials import MATERIALS
from hapticvlm.rendering.voices import Voices

RATE_HZ = 8
SIZE = (768, 432)
QUALITY = 55
LARGEST_BYTES = 3_000_000  # a README is read on telephones too


def main() -> None:
    """Draw it, and print how large it is."""
    parser = argparse.ArgumentParser(description="Draw the README's moving picture.")
    parser.add_argument("--session", type=Path, help="of `record` (the one in demo-output)")
    parser.add_argument("--out", type=Path, default=Path("docs/demo.webp"), help="(%(default)s)")
    options = parser.parse_args()
    write(options.session or _newest(Path("demo-output/session")), options.out)
    size = options.out.stat().st_size
    print(f"{options.out}: {size / 1e6:.2f} MB")
    if size > LARGEST_BYTES:
        raise SystemExit(f"above {LARGEST_BYTES / 1e6:.0f} MB: lower QUALITY, SIZE or RATE_HZ")


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


def _newest(folder: Path) -> Path:
    """Return the session of this folder whose frames were kept."""
    found = [path for path in folder.glob("*") if (path / "frames").is_dir()]
    if not found:
        raise SystemExit(f"{folder}: no session with frames; run `make demo` first")
    return max(found)


if __name__ == "__main__":
    main()
