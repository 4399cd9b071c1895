"""Assembles a page into one file: styles, scripts, data and sound are written into it.

The page then opens from a disk, without a service and without a network, and can be sent on.
"""

from __future__ import annotations

import base64
import io
import json
from collections.abc import Iterable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hapticvlm.rendering.vibration.vibration import RATE_HZ

PAGES = Path(__file__).parents[2] / "pages"
SOUND_HZ = 8000  # the lowest rate that browsers play; the vibration ends at 1 kHz


def assembled(
    markup: str, styles: Iterable[Path], modules: Iterable[Path], script: Path, data: object
) -> str:
    """Write styles, modules, the script that imports them and its data into a page's markup."""
    for file in styles:
        style = f"<style>\n{file.read_text(encoding='utf-8')}</style>"
        markup = put(markup, f'<link rel="stylesheet" href="{file.name}">', style)
    for file in modules:
        markup = put(markup, f'"{file.name}"', f'"{address("text/javascript", file.read_bytes())}"')
    tag = f'<script type="module" src="{script.name}"></script>'
    code = script.read_text(encoding="utf-8")
    markup = put(markup, tag, f'<script type="module">\n{code}</script>')
    content = json.dumps(data, allow_nan=False).replace("<", "\\u003c")
    return put(markup, ">null</script>", f">{content}</script>")


def put(markup: str, place: str, new: str) -> str:
    """Replace the only occurrence of `place` in a page's markup."""
    assert markup.count(place) == 1, place
    return markup.replace(place, new)


def address(kind: str, data: bytes) -> str:
    """Return a data URL with these bytes."""
    return f"data:{kind};base64,{encoded(data)}"


def encoded(data: bytes) -> str:
    """Return bytes as text (base64)."""
    return base64.b64encode(data).decode()


def sound(wave: NDArray[np.float32]) -> bytes:
    """Return a vibration (N,) at RATE_HZ as a WAV file at SOUND_HZ."""
    import soundfile
    from scipy.signal import resample_poly

    slowed = resample_poly(wave, SOUND_HZ, RATE_HZ) if wave.size else np.zeros(1, np.float32)
    file = io.BytesIO()
    soundfile.write(file, np.clip(slowed, -1.0, 1.0), SOUND_HZ, format="WAV", subtype="PCM_16")
    return file.getvalue()
