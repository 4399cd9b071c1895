"""Tests the amplitudes for controllers: all materials are felt, in the order of the palm."""

import itertools
from functools import cache

import numpy as np
import pytest
from each_case import each

from hapticvlm.materials import MATERIALS
from hapticvlm.rendering.vibration.controller_scale import Form, controller_amplitude, loudness
from hapticvlm.rendering.vibration.vibration import Motion
from hapticvlm.rendering.vibration.vibration_plan import PERIOD_S, PLAN_HZ, VibrationPlanner, levels
from hapticvlm.rendering.vibration.voices import Command

FORMS: tuple[Form, ...] = ("amplitude", "parametric")
BLOWS = {"tap": Motion(0.3, 1.5), "strike": Motion(1.0, 4.0), "press": Motion(0.05, 2.0)}
SLIDES_MPS = (0.1, 0.3, 1.0)
LIKE = 10 ** (1.6 / 20)  # levels nearer than a just noticeable difference have no order


@pytest.fixture(scope="module")
def planner():
    return VibrationPlanner(MATERIALS)


def struck(planner, material, kind, form, motion):
    """The plan of an impact that begins now."""
    planner._voices.silence()
    planner.apply(Command(1, material, kind, True, motion, 1, 1.25), 1.0)
    return planner.plan(form, 1.0)


@cache
def rubbed(planner, material, speed_mps, form):
    """The amplitudes (N,) of half a second of a slide."""
    planner._voices.silence()
    played = []
    for step in range(40):
        now = 1.0 + 0.02 * step
        motion = Motion(speed_mps, 1.5)
        planner.apply(Command(1, material, "slide", step == 0, motion, 1, now + 0.25), now)
        if step >= 14 and step % 2 == 0:
            plan = planner.plan(form, now)
            played += plan.amplitude[: round(0.04 / PERIOD_S[form])]
    return np.array(played)


def palm_level(planner, material, kind, motion, form):
    """Level for the palm: of an impact the strongest period, of a slide the mean one."""
    voices = planner._voices
    voices.silence()
    is_slide = kind == "slide"
    voices.apply(Command(1, material, kind, not is_slide, motion, 1, 9.0))
    voices.render(round(0.3 * PLAN_HZ) if is_slide else 0, 0.0)
    wave = voices.render(round(0.5 * PLAN_HZ), 0.3)
    level = levels(loudness(wave, PLAN_HZ) if form == "amplitude" else wave, PERIOD_S[form])
    voices.silence()
    return level.mean() if is_slide else level.max()


@each(material=MATERIALS, form=FORMS)
def test_every_material_is_felt_on_a_controller_and_leaves_it_room(planner, material, form):
    tap = max(struck(planner, material, "tap", form, BLOWS["tap"]).amplitude)
    press = max(struck(planner, material, "press", form, BLOWS["press"]).amplitude)
    strike = max(struck(planner, material, "strike", form, BLOWS["strike"]).amplitude)
    slow, usual, fast = (rubbed(planner, material, speed, form).mean() for speed in SLIDES_MPS)
    assert 0.1 <= tap < strike <= 1.0
    assert press >= 0.1
    assert 0.2 <= usual <= 0.7
    assert 0.08 <= slow < usual < fast <= 0.7


@pytest.mark.parametrize("form", FORMS)
def test_the_strongest_slide_of_all_materials_is_near_six_tenths(planner, form):
    strongest = max(rubbed(planner, material, 1.0, form).mean() for material in MATERIALS)
    assert strongest == pytest.approx(0.6, abs=0.08)


@each(kind=["tap", "strike", "press", "slide"], form=FORMS)
def test_the_order_of_materials_is_that_of_the_palm(planner, kind, form):
    motion = BLOWS.get(kind, Motion(0.3, 1.5))
    felt = {name: palm_level(planner, name, kind, motion, form) for name in MATERIALS}
    played = {
        name: rubbed(planner, name, 0.3, form).mean()
        if kind == "slide"
        else max(struck(planner, name, kind, form, motion).amplitude)
        for name in MATERIALS
    }
    for one, other in itertools.permutations(MATERIALS, 2):
        if felt[one] > LIKE * felt[other]:
            assert played[one] > played[other] or played[one] == 1.0, (one, other)


def test_the_lightest_touch_of_a_weak_material_is_still_a_tap(planner):
    for form in FORMS:
        plan = struck(planner, "rubber", "tap", form, Motion(0.02, 0.05))
        assert max(plan.amplitude) == pytest.approx(0.1, abs=1e-3)


@pytest.mark.parametrize("form", FORMS)
def test_half_the_gain_is_half_the_amplitude_and_none_is_rest(planner, form):
    whole = struck(planner, "wood", "strike", form, BLOWS["strike"]).amplitude
    planner.gain = 0.5
    half = struck(planner, "wood", "strike", form, BLOWS["strike"])
    planner.gain = 0.0
    none = struck(planner, "wood", "strike", form, BLOWS["strike"])
    planner.gain = 1.0
    assert half.amplitude == pytest.approx(np.array(whole) / 2, abs=1e-3)
    assert none.amplitude == ()


@each(material=MATERIALS, form=FORMS)
def test_a_controller_rests_within_one_period_of_a_stop(planner, material, form):
    assert rubbed(planner, material, 0.3, form).size
    planner.rest()
    assert planner.plan(form, 2.0).amplitude == ()


def test_a_tone_is_worth_what_a_palm_feels_of_it():
    time = np.arange(400) / PLAN_HZ
    strength = {
        hz: levels(loudness(np.sin(2 * np.pi * hz * time).astype(np.float32), PLAN_HZ), 0.05)[0]
        for hz in (160, 250, 500)
    }
    assert strength[160] == pytest.approx(1.0, abs=0.1)
    assert strength[160] > strength[250] > 5.0 * strength[500]


def test_silence_is_silence_and_full_scale_is_the_strongest():
    for form in FORMS:
        played = controller_amplitude(np.array([0.0, 5e-4, 1.0, 7.0]), form)
        assert played.tolist() == [0.0, 0.0, 1.0, 1.0]
