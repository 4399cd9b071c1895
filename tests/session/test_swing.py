"""What a scene says of the thing that is swung is what the palm feels: all the way to the sound."""

import numpy as np
import pytest
from session_messages import only, owner, touch

from hapticvlm.devices.speaker.ring import Ring
from hapticvlm.messages import SceneObject
from hapticvlm.rendering.vibration.vibration import RATE_HZ
from hapticvlm.rendering.vibration.voices import Command, Voices
from hapticvlm.session.actions import PlayVibration

BLOCK, SPEED_MPS = 480, 3.0


def swung(thickness_m):
    """Swing an object of this thickness for a second; what the palm speaker would play, (N,)."""
    rod = SceneObject(object_id="rod", material="metal", thickness_m=thickness_m)
    session, ring, voices = owner(rod), Ring.create(), Voices()
    swing = {"interaction": "swing", "speed_mps": SPEED_MPS, "force_n": 0.0}
    blocks, taken = [], 0
    for now in np.arange(0.0, 1.2, BLOCK / RATE_HZ):
        for play in only(
            session.receive(touch("approach", "rod", now, **swing), now), PlayVibration
        ):
            ring.put(play.command, now)
        for number, _, order in ring.take(taken):
            assert isinstance(order, Command)
            voices.apply(order)
            taken = number
        blocks.append(voices.render(BLOCK, now))
    return np.concatenate(blocks)[round(0.2 * RATE_HZ) :]


def pitch_hz(wave):
    """Where half of the power lies below."""
    power = np.abs(np.fft.rfft(wave * np.hanning(wave.size))) ** 2
    middle = np.searchsorted(np.cumsum(power), power.sum() / 2.0)
    return middle * RATE_HZ / wave.size


@pytest.mark.parametrize("thickness_m", [0.004, 0.008])
def test_a_thing_of_half_the_thickness_whooshes_an_octave_higher(thickness_m):
    thick, thin = pitch_hz(swung(thickness_m)), pitch_hz(swung(thickness_m / 2.0))

    assert 1.6 < thin / thick < 2.4


def test_a_whoosh_is_at_the_rate_of_the_vortices():
    assert pitch_hz(swung(0.005)) == pytest.approx(0.2 * SPEED_MPS / 0.005, rel=0.25)
