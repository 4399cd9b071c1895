"""Plays the bake of the built-in materials with the web client's player, in Node.

The player is what a scene ships instead of a service, so its own waves are felt, not those of the
service's synthesis.
"""

from __future__ import annotations

import base64
import json
import shutil
import subprocess
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hapticvlm.materials import MATERIALS
from hapticvlm.rendering.vibration import feel_clips
from hapticvlm.rendering.vibration.vibration import RATE_HZ
from hapticvlm_lab.bench.vibration.spectra import RUBBED, SIZE, STEADY_S

CLIENT = Path(__file__).parents[4] / "examples" / "webxr" / "client"
LONGEST_S = 600.0  # of all materials, on a busy machine

Wave = NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class Played:
    """A strike and a stroke by material, (N,) at RATE_HZ."""

    strikes: Mapping[str, Wave]
    slides: Mapping[str, Wave]


def can_play() -> bool:
    """Return whether Node and the client are here."""
    return shutil.which("node") is not None and (CLIENT / "player.js").is_file()


@cache
def played() -> Played:
    """Play every material of the table once."""
    script = Path(__file__).with_name("play_bake.mjs")
    numbers = (RATE_HZ, SIZE / RATE_HZ, STEADY_S, RUBBED.speed_mps)
    with tempfile.TemporaryDirectory() as folder:
        feel = Path(folder) / "feel.true.json"
        feel.write_bytes(feel_clips.encode(feel_clips.feel(MATERIALS, "true")))
        command = ["node", str(script), str(CLIENT), str(feel), *map(str, numbers)]
        ran = subprocess.run(command, stdout=subprocess.PIPE, check=True, timeout=LONGEST_S)
    waves = json.loads(ran.stdout)
    strikes, slides = (
        {name: _wave(each[kind]) for name, each in waves.items()} for kind in ("strike", "slide")
    )
    return Played(strikes, slides)


def _wave(text: str) -> Wave:
    return np.frombuffer(base64.b64decode(text), dtype=np.float32)
