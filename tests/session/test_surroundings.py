"""The surroundings of a scene: asked about on change, never in a hurry, believed slowly."""

import math

import numpy as np
import pytest

from hapticvlm.evidence.ambient import SceneView
from hapticvlm.evidence.reading import Reading
from hapticvlm.session.surroundings import Surroundings


def sight(seed: int, brightness: float = 0.5) -> SceneView:
    vector = np.random.default_rng(seed).normal(size=128).astype(np.float32)
    return SceneView(vector / np.linalg.norm(vector), brightness)


def reading(value_c: float, half_c: float = 4.0) -> Reading:
    return Reading(value_c, value_c - half_c, value_c + half_c, None, "readout", 1.0)


KITCHEN, SNOW, BEACH = sight(1), sight(2), sight(3)


class AmbientRun:
    """A scene that is looked at twice a second, with a model that answers after a second."""

    def __init__(self, answers=lambda _: reading(25.0)):
        self.around = Surroundings(can_ask=True)
        self.answers = answers
        self.now = 0.0
        self.asked: list[float] = []
        self.felt: list[float] = []

    def show(self, what, seconds):
        due: list[tuple[float, int]] = []
        for _ in range(round(seconds / 0.5)):
            seen = what(self.now) if callable(what) else what
            self.around.update(self.now)
            for at, view in due.copy():
                if self.now >= at:
                    due.remove((at, view))
                    answer = self.answers(seen)
                    if answer is None:
                        self.around.fail(view)
                    else:
                        self.around.add_reading(view, answer, self.now)
            if self.around.wants_scene_view(self.now):
                asked = self.around.update_view(seen, self.now)
                if asked is not None:
                    self.asked.append(self.now)
                    due.append((self.now + 1.0, asked))
            self.felt.append(self.around.ambient.value_c)
            self.now += 0.5
        return self.around.ambient


def test_without_anybody_to_ask_no_frame_is_looked_at_for_its_place():
    around = Surroundings()
    assert not around.wants_scene_view(0.0)
    assert around.ambient.source == "default"


def test_the_scenes_own_value_wins_and_ends_the_asking():
    course = AmbientRun()
    assert course.show(KITCHEN, 10.0).source == "vlm"
    course.around.scene_c = -3.0
    asked = len(course.asked)
    told = course.show(SNOW, 60.0)
    assert (told.value_c, told.source) == (-3.0, "scene")
    assert len(course.asked) == asked


def test_a_first_frame_is_asked_about_at_once_and_a_place_that_stays_is_asked_about_once():
    course = AmbientRun()
    course.show(KITCHEN, 300.0)
    assert course.asked == [0.0]


def test_frames_are_looked_at_twice_a_second_however_many_come():
    around = Surroundings(can_ask=True)
    looks = [at for at in np.arange(0.0, 10.0, 1 / 90) if around.wants_scene_view(float(at))]
    assert 18 <= len(looks) <= 20


def test_a_new_view_that_lasts_is_asked_about_and_a_glance_is_not():
    course = AmbientRun()
    course.show(KITCHEN, 20.0)
    course.show(SNOW, 2.0)
    course.show(KITCHEN, 20.0)
    assert len(course.asked) == 1
    course.show(SNOW, 2.5)
    assert len(course.asked) == 2


def test_questions_keep_to_their_budget_however_often_the_scene_changes():
    course = AmbientRun()
    course.show(lambda now: sight(100 + int(now / 3.0)), 300.0)
    assert len(course.asked) > 5
    assert np.diff(course.asked).min() == 11.0  # the first view that has lasted after 10 s


@pytest.mark.parametrize("period_s", [1.0, 5.0, 10.0, 30.0])
def test_a_flickering_light_is_asked_about_twice_and_the_ambient_comes_to_rest(period_s):
    course = AmbientRun(lambda seen: reading(30.0 if seen.brightness > 0.5 else 15.0, half_c=2.0))
    course.show(
        lambda now: sight(1, 0.9 if now % period_s < period_s / 2 else 0.1), 10 * period_s + 60.0
    )
    assert len(course.asked) <= 2
    assert len(set(course.felt[-int(4 * period_s / 0.5) :])) == 1


def test_a_new_climate_is_believed_and_felt_slowly_in_steps():
    course = AmbientRun(lambda seen: reading(24.0 if seen is KITCHEN else -5.0))
    course.show(KITCHEN, 40.0)
    assert course.around.ambient.value_c == pytest.approx(24.0)
    told = course.show(SNOW, 8.0)
    assert 0.0 < told.value_c < 24.0
    assert (told.low_c, told.high_c) == (-9.0, told.value_c)  # from what it will be to what it is
    told = course.show(SNOW, 52.0)
    assert told.value_c == pytest.approx(-5.0)
    assert (told.low_c, told.high_c) == (-9.0, -1.0)
    steps = np.abs(np.diff(course.felt[-120:]))
    assert 0.0 < steps.max() < 0.15 * 29.0
    assert steps[steps > 0].min() >= 0.495


def test_readings_of_one_climate_are_averaged_and_their_disagreement_widens_the_interval():
    course = AmbientRun(lambda seen: reading(20.0 if seen is KITCHEN else 24.0))
    course.show(KITCHEN, 20.0)
    told = course.show(BEACH, 60.0)
    assert told.value_c == pytest.approx(22.0)
    assert told.high_c - told.value_c == pytest.approx(math.hypot(4.0, 2.0))


def test_a_place_seen_before_is_not_asked_about_again():
    course = AmbientRun(lambda seen: reading(24.0 if seen is KITCHEN else -5.0))
    for place in (KITCHEN, SNOW) * 4:
        felt = course.show(place, 60.0)
        assert felt.value_c == pytest.approx(24.0 if place is KITCHEN else -5.0)
    assert len(course.asked) == 2


@pytest.mark.parametrize(
    "answer",
    [
        reading(15.0, 45.0),
        Reading(math.nan, 0.0, 1.0, None, "text", 1.0),
        Reading(20.0, -math.inf, 25.0, None, "text", 1.0),
        Reading(20.0, 25.0, 15.0, None, "text", 1.0),
    ],
)
def test_an_answer_that_tells_nothing_leaves_the_default(answer):
    course = AmbientRun(lambda _: answer)
    assert course.show(KITCHEN, 60.0).source == "default"


def test_a_model_that_fails_is_asked_less_and_less_often_and_the_default_holds():
    course = AmbientRun(lambda _: None)
    assert course.show(KITCHEN, 3000.0).source == "default"
    pauses = np.diff(course.asked)
    assert pauses[0] == pytest.approx(20.0, abs=1.0)
    assert pauses[-1] == pytest.approx(300.0, abs=1.0)
    course.answers = lambda _: reading(30.0)
    assert course.show(KITCHEN, 400.0).source == "vlm"


def test_a_question_nobody_answers_does_not_end_the_asking():
    around = Surroundings(can_ask=True)
    assert around.update_view(KITCHEN, 0.0) is not None
    assert around.update_view(SNOW, 5.0) is None
    asked = [at for at in range(5, 400, 1) if around.update_view(SNOW, float(at)) is not None]
    assert asked == [121]


def test_the_newest_views_are_remembered_up_to_a_number():
    course = AmbientRun()
    for number in [*range(33), *range(1, 33), 0]:  # 32, and then the one that was forgotten
        course.show(sight(500 + number), 15.0)
    assert len(course.asked) == 34


def test_a_clock_that_jumps_back_neither_raises_nor_leaps():
    course = AmbientRun(lambda seen: reading(24.0 if seen is KITCHEN else 10.0))
    course.show(KITCHEN, 30.0)
    course.now -= 1000.0
    told = course.show(SNOW, 30.0)
    assert 9.0 < told.value_c < 25.0
