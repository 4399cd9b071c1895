"""Writes a recorded session as one HTML file: frames, decisions, plate, sound and a scrubber.

Everything is in the file, so that it opens without a service and can be sent on. The page itself
is session.html beside this module; its style, its scripts and the palette of all pages are written
into it.
"""

from __future__ import annotations

import html
import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hapticvlm import documents
from hapticvlm.materials import MATERIALS
from hapticvlm.recordings.page.moment import Moment, strongest
from hapticvlm.recordings.page.one_file import (
    HEARD_HZ,
    PAGES,
    SAVING,
    address,
    assembled,
    plan,
    put,
    sound,
)
from hapticvlm.recordings.timeline import Decided, Picture, Timeline
from hapticvlm.rendering.vibration.sound_voice import as_sound
from hapticvlm.rendering.vibration.vibration import RATE_HZ

HERE = Path(__file__).parent
PEAKS_PER_S = 100
LONGEST_S = 900.0  # browsers load larger files badly
_FIELDS = (
    *("object_id", "surface", "material", "confidence", "runner_up", "source", "evidence"),
    *("basis", "felt", "pattern"),
    *("contact_c", "setpoint_c", "thermal_cue", "limited_by"),
)
_TYPES = {".jpg": "image/jpeg", ".png": "image/png"}


def write(timeline: Timeline, title: str, path: Path, shared: Moment | None = None) -> None:
    """Write the page; with `shared` it opens at that moment and has its title. Raises OSError.

    A session may come from somebody else, and a link of this name in its folder may point at any
    file of the user. So a link is replaced, never followed.
    """
    data = document(timeline, title)
    if shared is not None:
        data |= {"title": shared.title, "at_s": shared.t_s}
    documents.replace_file(path, page(data, shared))


def document(timeline: Timeline, title: str) -> dict[str, Any]:
    """Return the content of the page, as JSON can hold it."""
    return {
        "title": title,
        "facts": f"{timeline.duration_s:.1f} s, {len(timeline.touches)} touches, "
        f"{len(timeline.pictures)} frames; vibration rendered again from the record",
        "at_s": strongest(timeline),
        "duration_s": round(timeline.duration_s, 3),
        "frames": [_frame(picture) for picture in timeline.pictures],
        "decisions": [_decision(decided) for decided in timeline.decisions],
        "touches": [
            {
                "hand": touch.hand,
                "object_id": touch.object_id,
                "surface": touch.surface,
                "name": timeline.title(touch.target),
                "from_s": round(touch.from_s, 3),
                "to_s": round(touch.to_s, 3),
                "motion": [(round(t_s, 3), is_moving) for t_s, is_moving in touch.motion],
            }
            for touch in timeline.touches
        ],
        "plate": [
            {"t_s": round(at.t_s, 3), "setpoint_c": at.setpoint_c, "plate_c": at.plate_c}
            for at in timeline.plate
        ],
        "peaks": _peaks(timeline.wave),
        "plan": plan(timeline.wave),
        "voices": {
            "sound": address("audio/wav", sound(as_sound(timeline.wave), HEARD_HZ)),
            "true": address("audio/wav", sound(timeline.wave)),
        },
    }


def page(session: dict[str, Any], shared: Moment | None = None) -> str:
    """Write the session, styles and scripts into the page."""
    markup = (HERE / "session.html").read_text(encoding="utf-8")
    if shared is not None:
        markup = _titled(markup, shared)
    return assembled(
        markup,
        (PAGES / "palette.css", HERE / "session.css"),
        (
            *SAVING,
            *(PAGES / name for name in ("try.card.js", "try.rumble.js")),
            HERE / "outline.js",
        ),
        HERE / "session.js",
        session,
    )


def _titled(markup: str, shared: Moment) -> str:
    """Describe the page in its head, for programs that run no script: chat cards, previews, search.

    The picture is in the file, because a page that is sent on has no address. A host that wants
    `og:image` as an address must put the picture beside the page.
    """
    title, words = html.escape(shared.title), html.escape(shared.description)
    head = [f"<title>{title}</title>", f'<meta name="description" content="{words}">']
    head += [_property("og:title", title), _property("og:description", words)]
    figure = f"<h1>{title}</h1><p>{words}</p>"
    if shared.poster is not None:
        poster = address("image/jpeg", shared.poster)
        head += [_property("og:image", poster)]
        figure = f'<img src="{poster}" alt="{title}">{figure}'
    markup = put(markup, "<title>HapticVLM session</title>", "\n".join(head))
    return put(markup, "<header>", f"<noscript>{figure}</noscript>\n<header>")


def _property(name: str, content: str) -> str:
    return f'<meta property="{name}" content="{content}">'


def _frame(picture: Picture) -> dict[str, Any]:
    return {
        "t_s": round(picture.t_s, 3),
        "object_id": picture.object_id,
        "region": picture.region,
        "image": _file(picture.file),
        "mask": None if picture.mask is None else _file(picture.mask),
    }


def _file(path: Path) -> str:
    return address(_TYPES[path.suffix], path.read_bytes())


def _decision(decided: Decided) -> dict[str, Any]:
    fields = {name: decided.decision.get(name) for name in _FIELDS}
    material = MATERIALS.get(fields["felt"] or fields["material"] or "")
    return {"t_s": round(decided.t_s, 3), **fields, "feels": material.feels if material else []}


def _peaks(wave: NDArray[np.float32]) -> list[float]:
    size = RATE_HZ // PEAKS_PER_S
    rows = np.abs(wave[: wave.size // size * size]).reshape(-1, size)
    peaks: list[float] = np.round(rows.max(axis=1, initial=0.0), 3).tolist()
    return peaks


def at(path: Path, time_s: float | None) -> str:
    """Return the address of the page, at a time if one is given."""
    whole = path.resolve().as_uri()
    return whole if time_s is None else f"{whole}#t={time_s:.2f}"


def safe_name(folder: Path) -> str:
    """Return a title for a session's folder: its name without characters of markup."""
    return re.sub(r"[^\w.-]+", " ", folder.resolve().name)[:80]
