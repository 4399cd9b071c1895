"""Renders a touch as outputs that people own already play it: what is lost is heard and seen. Pure.

- `quest`: the wave at the rate of a controller's samples, without heat.
- `pad`, `phone`: one strength every 12.5 ms of a tone near 160 Hz (`controller_scale`), no heat.
- `intiface`: the strongest of each 50 ms of these, with heat where a device has it.
- `weart`: a texture, a click and a force of the glove's own, told in its texts; with heat.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from hapticvlm.devices.worn import touchdiver
from hapticvlm.devices.worn.intiface import PLAN_S
from hapticvlm.devices.worn.output import Touch, Wanted
from hapticvlm.perception import NEUTRAL_C
from hapticvlm.rendering.vibration.controller_scale import CARRIER_HZ, MIN_IMPACT
from hapticvlm.rendering.vibration.filters import resample
from hapticvlm.rendering.vibration.vibration import RATE_HZ
from hapticvlm.rendering.vibration.vibration_plan import PERIOD_S, PLAN_HZ, amplitudes
from hapticvlm.touches import GLOVE
from hapticvlm.touches.heat import Heat
from hapticvlm.touches.sound import Sound, commands

HEATS = ("intiface", GLOVE)
QUEST_HZ = 2000  # our assumption: the runtime tells each controller's rate

_Wave = NDArray[np.float32]


def sound_on(output: str, of: Sound) -> Sound:
    """Return the vibration as this output plays it; `weart` plays none that could be rendered."""
    if output == GLOVE:
        return replace(of, wave=np.zeros_like(of.wave))
    if output == "quest":
        step = RATE_HZ // QUEST_HZ
        wave = resample(resample(of.wave, 1, step), step, 1)
        return replace(of, wave=np.asarray(wave[: of.wave.size], dtype=np.float32))
    strength = amplitudes(resample(of.wave, 1, RATE_HZ // PLAN_HZ).astype(np.float32), "amplitude")
    onset, _ = commands(of.material.name, of.interaction, of.motion)
    if onset is not None:
        strength[:1] = np.maximum(strength[:1], MIN_IMPACT)
    if output == "intiface":
        size = round(PLAN_S / PERIOD_S["amplitude"])
        rows = np.pad(strength, (0, -strength.size % size)).reshape(-1, size)
        strength = np.repeat(rows.max(axis=1), size)
    return replace(of, wave=_tone(strength, of.wave.size))


def heat_on(output: str, of: Heat) -> Heat:
    """Return the heat as this output gives it: the neutral temperature where it has none."""
    if output in HEATS:
        return of
    ticks = len(of.time_s)
    return replace(of, setpoint_c=[NEUTRAL_C] * ticks, limited_by=[None] * ticks)


def glove_texts(of: Sound, heat: Heat) -> list[str]:
    """Return what a TouchDIVER's program is sent for this touch: at its contact, and later on."""
    onset, moved = commands(of.material.name, of.interaction, of.motion, of.thickness_m)
    table = {of.material.name: of.material}
    texts = []
    for word, command, age_s, setpoint_c in (
        ("at contact", onset or moved, 0.0, heat.setpoint_c[0]),
        ("after it", moved, 1.0, heat.setpoint_c[-1]),
    ):
        wanted = Wanted({1: Touch(command, onset, -age_s)}, setpoint_c)
        values = touchdiver.messages(wanted, table, 0.0)
        texts.append(f"{word}: {', '.join(f'{kind}:{text}' for (kind, _), text in values.items())}")
    return texts


def _tone(strength: NDArray[np.float64], count: int) -> _Wave:
    """Return a tone (count,) at RATE_HZ whose amplitude is `strength`, (periods,)."""
    each = np.repeat(strength, round(PERIOD_S["amplitude"] * RATE_HZ))
    wave = np.resize(np.pad(each, (0, max(0, count - each.size))), count)
    return np.asarray(
        wave * np.sin(2.0 * np.pi * CARRIER_HZ / RATE_HZ * np.arange(count)), dtype=np.float32
    )
