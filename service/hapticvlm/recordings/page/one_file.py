"""Assembles a page into one file: styles, scripts, data and sound are written into it.

The page then opens from a disk, without a service and without a network, and can be sent on. Names
in it may come from somebody else. So its policy lets a browser run the page's own script, known by
its hash, and load nothing but what is in the file.
"""

from __future__ import annotations

import base64
import hashlib
import json
import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hapticvlm.rendering.vibration import wav
from hapticvlm.rendering.vibration.filters import resample
from hapticvlm.rendering.vibration.vibration import RATE_HZ
from hapticvlm.rendering.vibration.vibration_plan import PERIOD_S, PLAN_HZ, amplitudes

PAGES = Path(__file__).parents[2] / "pages"
CHARSET = '<meta charset="utf-8">'  # which the policy follows, before anything that it governs
POLICY = (
    "default-src 'none'; img-src data:; media-src data:; connect-src data:; "
    "style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'; script-src 'sha256-{hash}'"
)
# The modules of `felt.saved.js`, each after those that it imports.
SAVING = tuple(
    PAGES / name for name in ("dom.js", "feel.js", "felt.js", "felt.formats.js", "felt.saved.js")
)
_EXPORT = re.compile(r"^export (?=(?:const|(?:async )?function) (\w+))", re.MULTILINE)
_IMPORT = re.compile(
    r'^import (\{[^}]*\}|\* as (\w+)) from "(?:hapticvlm/([\w.]+)|\./([\w.]+)\.js)";$',
    re.MULTILINE,
)
SOUND_HZ = 8000  # the lowest rate that browsers play; the vibration ends at 1 kHz
HEARD_HZ = 12_000  # for the sound voice, which ends at 5 kHz


def assembled(
    markup: str, styles: Iterable[Path], modules: Iterable[Path], script: Path, data: object
) -> str:
    """Write styles, modules, the script that imports them and its data into a page's markup."""
    for file in styles:
        style = f"<style>\n{file.read_text(encoding='utf-8')}</style>"
        markup = put(markup, f'<link rel="stylesheet" href="{file.name}">', style)
    code = f"\n{bundled(modules, script)}"
    policy = POLICY.format(hash=encoded(hashlib.sha256(code.encode()).digest()))
    tag = f'<meta http-equiv="Content-Security-Policy" content="{policy}">'
    markup = put(markup, CHARSET, f"{CHARSET}\n{tag}")
    tag = f'<script type="module" src="{script.name}"></script>'
    markup = put(markup, tag, f'<script type="module">{code}</script>')
    content = json.dumps(data, allow_nan=False).replace("<", "\\u003c")
    return put(markup, ">null</script>", f">{content}</script>")


def bundled(modules: Iterable[Path], script: Path) -> str:
    """Return one script: each module as an object of its exports, then the script that uses them.

    A script of its own cannot be a module of its own in the same file without a data address,
    and a policy that lets those run lets anybody's run. Modules export constants and functions only
    and import modules before them; each has its own scope, so their names do not meet.
    """
    parts = []
    for file in modules:
        code = file.read_text(encoding="utf-8")
        exports = ", ".join(_EXPORT.findall(code))
        body = _IMPORT.sub(_import, _EXPORT.sub("", code))
        name = _module(file.stem)
        parts.append(f"const {name} = (() => {{\n{body}return {{ {exports} }};\n}})();\n")
    return "".join([*parts, _IMPORT.sub(_import, script.read_text(encoding="utf-8"))])


def _import(statement: re.Match[str]) -> str:
    names, alias, shared, beside = statement.groups()
    return f"const {alias or names} = {_module(shared or beside)};"


def _module(stem: str) -> str:
    return f"module_{stem.replace('.', '_')}"


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


def plan(wave: NDArray[np.float32]) -> dict[str, Any]:
    """Return what a phone or gamepad plays of a wave (N,) at RATE_HZ, for `try.rumble.js`."""
    played = resample(wave, 1, RATE_HZ // PLAN_HZ).astype(np.float32)
    values = np.round(amplitudes(played, "amplitude"), 2)
    return {"period_ms": 1000.0 * PERIOD_S["amplitude"], "amplitude": values.tolist()}


def sound(wave: NDArray[np.float32], rate_hz: int = SOUND_HZ) -> bytes:
    """Return a wave (N,) at RATE_HZ as a WAV file at a lower rate."""
    slowed = resample(wave, rate_hz, RATE_HZ) if wave.size else np.zeros(1)
    return wav.encoded(slowed, rate_hz)
