"""The film that the demo draws of a recorded session."""

import numpy as np
import pytest
from PIL import Image
from recorded_session import record

from hapticvlm.materials import MATERIALS
from hapticvlm.recordings import timeline
from hapticvlm.rendering.vibration.vibration import RATE_HZ
from hapticvlm.rendering.vibration.voices import Voices
from hapticvlm_lab.bench.pictures import film, moving_picture


@pytest.fixture
def session(tmp_path):
    return record(tmp_path)


def read(folder):
    return timeline.read(folder, MATERIALS, Voices())


def test_a_moment_shows_the_frame_outlined_only_while_it_is_touched(session):
    what = read(session)
    touched, free = (np.asarray(film.picture(what, at_s)) for at_s in (1.0, 0.3))
    inside = (slice(12, 498), slice(12, 498))
    green = np.array(Image.new("RGB", (1, 1), film.WAVE))[0, 0]
    assert (np.abs(touched[inside].astype(int) - green).max(axis=2) < 8).sum() > 500
    assert (np.abs(free[inside].astype(int) - green).max(axis=2) < 8).sum() == 0


def test_the_drawn_wave_is_that_of_the_last_two_seconds(session):
    what = read(session)
    low, high = film.envelope(what.wave, 1.5, 400)
    before, since = high[:200], high[200:]  # the contact is 1 s ago: in the middle
    assert before.max() == 0.0
    assert since.max() == pytest.approx(what.wave[: int(1.5 * RATE_HZ)].max(), rel=0.05)
    assert low.min() < 0.0


def test_the_first_picture_shows_a_touched_object_and_is_not_black(session, tmp_path):
    out = tmp_path / "film.webp"
    moving_picture.write(session, out)
    first = np.asarray(Image.open(out).convert("RGB")).astype(int)
    frame = first[40:440, 20:380] if first.shape[0] > 440 else first[40:380, 20:380]
    assert frame.std() > 2.0


def test_a_stroke_is_drawn_high_enough_to_be_seen_beside_a_blow():
    low, high = (film.visible(np.array([level], np.float32))[0] for level in (-0.02, 0.02))
    assert (round(float(low), 2), round(float(high), 2)) == (-0.14, 0.14)
