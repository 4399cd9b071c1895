"""Compares the samples of a player of `feel.json` with the waves of the service, touch by touch."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from hapticvlm.materials import MATERIALS
from hapticvlm.rendering.vibration.equaliser import Playback
from hapticvlm.rendering.vibration.sound_voice import IN_HZ, SoundVoice
from hapticvlm.rendering.vibration.vibration import Motion
from hapticvlm.rendering.vibration.voices import Command, Voices
from hapticvlm.session.hands import LEASE_S

Json = dict[str, Any]
TOUCHES = [("glass", "strike"), ("rubber", "slide")]
HEARD_HZ = 8000
BLOCK = 128
BLOCKS = 24  # 0.4 s
PAGE_UP = 4
WINDOW_SAMPLES = 9  # by which the reader of the sound voice is late


def true_voice(material: str, phase: str) -> Json:
    """Return what a player is asked to render in the true voice."""
    return _asked(material, phase, HEARD_HZ, "true")


def sound_voice(material: str, phase: str, rate_hz: int) -> Json:
    """Return what a player is asked to render in the sound voice."""
    return _asked(material, phase, rate_hz, "sound")


def assert_is_the_true_voice(asked: Json, heard: NDArray[np.float64]) -> None:
    wanted = _by_the_service(asked, asked["rate"])
    assert np.sqrt(np.mean(wanted**2)) > 0.01
    assert np.sqrt(np.mean((heard - wanted) ** 2)) < 0.05 * np.sqrt(np.mean(wanted**2))


def assert_is_the_sound_voice(asked: Json, heard: NDArray[np.float64]) -> None:
    true = _by_the_service(asked, IN_HZ)
    wanted = SoundVoice(PAGE_UP).render(true.astype(np.float32))
    at = np.arange(heard.size) * PAGE_UP * IN_HZ / asked["rate"] - WINDOW_SAMPLES
    resampled = np.interp(at, np.arange(wanted.size), wanted)
    assert np.sqrt(np.mean(wanted**2)) > 0.03
    assert np.corrcoef(heard, resampled)[0, 1] > 0.97
    assert np.std(heard) == pytest.approx(np.std(resampled), rel=0.1)


def _asked(material: str, phase: str, rate_hz: int, voice: str) -> Json:
    """A strike, or a stroke that is renewed every 64 ms, as blocks of samples."""
    fields = {"hand": "right", "object_id": material, "speed_mps": 0.4, "force_n": 1.5}
    touches = [
        {
            "block": round(at * rate_hz / HEARD_HZ),
            "touch": {**fields, "phase": "contact" if not at else "slide"},
        }
        for at in range(0, 1 if phase == "strike" else BLOCKS, 4)
    ]
    blocks = round(BLOCKS * rate_hz / HEARD_HZ)
    return {"rate": rate_hz, "voice": voice, "block": BLOCK, "blocks": blocks, "touches": touches}


def _by_the_service(asked: Json, rate_hz: int) -> NDArray[np.float64]:
    """The true voice at `rate_hz`, in blocks as long as those asked for."""
    block = asked["block"] * rate_hz / asked["rate"]  # samples, with fractions
    voices = Voices(1.0, MATERIALS, Playback(rate_hz, full_scale_db=None))
    played = []
    for at in range(asked["blocks"]):
        for each in (one for one in asked["touches"] if one["block"] == at):
            is_onset = each["touch"]["phase"] == "contact"
            kind = "strike" if is_onset else "slide"
            ends = at * block / rate_hz + LEASE_S
            material = each["touch"]["object_id"]
            voices.apply(Command(1, material, kind, is_onset, Motion(0.4, 1.5), 1, ends))
        begin, end = round(at * block), round((at + 1) * block)
        played.append(voices.render(end - begin, begin / rate_hz))
    return np.concatenate(played)
