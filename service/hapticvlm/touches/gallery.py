"""Writes one page of touches of materials, to hear, to compare and to download for other tools.

The page contains all sounds and files, so it can be opened from a disk and needs no server.
"""

from __future__ import annotations

import gzip
import html
import json
from collections.abc import Iterable
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np

from hapticvlm.recordings.page.one_file import (
    HEARD_HZ,
    PAGES,
    SAVING,
    assembled,
    encoded,
    plan,
    put,
    sound,
)
from hapticvlm.rendering.vibration.sound_voice import as_sound
from hapticvlm.touches import ahap, haptic
from hapticvlm.touches.clip import Clip

HERE = Path(__file__).parent
KINDS = ("haptic", "ahap", "wav")
COLUMNS = 100  # of the outline of a vibration
STOPS = 5  # of the colours of a temperature bar


def page(clips: Iterable[Clip], voice: str = "sound") -> str:
    """Return the page of these clips, a section for each run of the same material.

    It plays them in this voice (`vibration.VOICES`) until the reader chooses the other one.
    """
    sections: list[str] = []
    data: dict[str, dict[str, Any]] = {}
    for _, group in groupby(clips, key=lambda clip: clip.material):
        touches = list(group)
        sections.append(_section(touches))
        data |= {clip.name: _facts(clip) | _files(clip) for clip in touches}
    template = (HERE / "gallery.html").read_text(encoding="utf-8")
    option = f'<option value="{voice}">'
    template = put(template, option, option.replace(">", " selected>"))
    filled = put(template, '<main id="main">\n', '<main id="main">\n' + "\n".join(sections))
    styles = (PAGES / "palette.css", HERE / "gallery.css")
    modules = (*SAVING, PAGES / "try.rumble.js")
    return assembled(filled, styles, modules, HERE / "gallery.js", data)


def _section(touches: list[Clip]) -> str:
    heat, name = touches[0].heat, html.escape(touches[0].material)
    at = np.linspace(0, len(heat.skin_c) - 1, STOPS).astype(int)
    skin = " ".join(f"{heat.skin_c[index]:.1f}" for index in at)
    words = f"At {heat.surface_c:.0f} °C it changes skin of 32 °C to {heat.contact_c:.1f} °C"
    items = "\n".join(_item(clip) for clip in touches)
    return (
        f'<section data-material="{name}" aria-label="{name}"><h2>{name}</h2>\n'
        f'<p class="warmth"><span class="bar" data-skin="{skin}"></span>{words}</p>\n'
        f'<ul class="touches">\n{items}\n</ul></section>'
    )


def _item(clip: Clip) -> str:
    name = html.escape(clip.name)
    touch = html.escape(f"{clip.material}, {clip.interaction}")
    files = "".join(
        f'<button type="button" data-touch="{name}" data-kind="{kind}" '
        f'aria-label="{label} of {touch}">{label}</button>'
        for kind, label in [("zip", "everything"), *((kind, f".{kind}") for kind in KINDS)]
    )
    return (
        f"<li><h3>{html.escape(clip.interaction)}</h3>"
        f'<button class="play" type="button" aria-pressed="false" data-touch="{name}" '
        f'aria-label="play {touch}">{_curve(clip)}</button><details class="files">'
        f"<summary>Save<span class=unseen> {touch}</span></summary>{files}</details></li>"
    )


def _curve(clip: Clip) -> str:
    """Return the outline of the vibration over time as SVG, its full height being full scale."""
    rows = np.array_split(np.abs(clip.wave), COLUMNS)
    # The square root: otherwise soft textures would be flat lines beside strikes.
    highs = [round(50.0 * float(np.sqrt(row.max(initial=0.0))), 1) for row in rows]
    above = [f"{x},{50.0 - high:g}" for x, high in enumerate(highs)]
    below = [f"{x},{50.0 + high:g}" for x, high in reversed(list(enumerate(highs)))]
    points = " ".join(above + below)
    return (
        f'<svg viewBox="0 0 {COLUMNS - 1} 100" preserveAspectRatio="none" aria-hidden="true">'
        f'<polygon points="{points}"/></svg>'
    )


def _facts(clip: Clip) -> dict[str, Any]:
    heat = clip.heat
    decision = {"material": clip.material, "thermal_cue": heat.thermal_cue}
    return {
        "interaction": clip.interaction,
        "decision": decision | {"setpoint_c": heat.contact_c},
        "plan": plan(clip.wave),
    }


def _files(clip: Clip) -> dict[str, str]:
    documents = {
        "haptic": haptic.document(clip),
        "ahap": ahap.document(clip),
    }
    packed = {kind: encoded(_packed(document)) for kind, document in documents.items()}
    return {
        **packed,
        "wav": encoded(sound(clip.wave)),
        "heard": encoded(sound(as_sound(clip.wave), HEARD_HZ)),
    }


def _packed(document: dict[str, Any]) -> bytes:
    return gzip.compress(json.dumps(document).encode(), mtime=0)
