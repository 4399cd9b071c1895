"""Surface temperature: the scene's word, the name, the sun, the ambient, in that order."""

from functools import partial
from pathlib import Path
from typing import Any, get_args

import pytest
from each_case import each, each_row
from hypothesis import given
from hypothesis import strategies as st
from word_tables import cases, words

from hapticvlm import materials, messages
from hapticvlm.evidence import temperature_words
from hapticvlm.evidence.ambient import Ambient, ambient
from hapticvlm.evidence.surface import (
    LEAST_C,
    MOST_C,
    Surface,
    SurfaceFacts,
    named,
    stated,
    sunned,
    surface,
)

WORDS = partial(words, Path(__file__).with_name("temperatures.csv"))
ROOM = Ambient(21.0, 19.0, 23.0, "scene")
FROST = Ambient(-12.0, -15.0, -9.0, "scene")
HEAT_WAVE = Ambient(38.0, 36.0, 40.0, "scene")


def by_name(name: str, around: Ambient = ROOM) -> Surface | None:
    return named(SurfaceFacts(name=name), around)


def felt(name: str, around: Ambient = ROOM) -> Surface:
    found = by_name(name, around)
    assert found is not None, name
    return found


def in_sun(material: str | None, name: str | None = None, around: Ambient = ROOM) -> Surface:
    found = sunned(SurfaceFacts(name=name, material=material, sunlit=True), around)
    assert found is not None, material
    return found


def test_the_scene_is_taken_at_its_word_before_name_and_sun() -> None:
    found = surface(SurfaceFacts("ice_cube", "stove_on", "metal", 31.5, True), ROOM)
    assert (found.value_c, found.low_c, found.high_c, found.source) == (31.5, 31.5, 31.5, "scene")


def test_zero_degrees_stated_is_a_statement() -> None:
    assert surface(SurfaceFacts("kettle_on", stated_c=0.0), ROOM).value_c == 0.0


def test_the_name_goes_before_the_sun_and_the_sun_before_the_ambient() -> None:
    for name, source in (("ice_cube", "name"), ("bench", "sun")):
        assert surface(SurfaceFacts(name, material="wood", sunlit=True), ROOM).source == source


def test_an_unknown_object_is_as_warm_as_its_surroundings_and_labelled() -> None:
    for facts in (SurfaceFacts(), SurfaceFacts("Stove"), SurfaceFacts("sofa", sunlit=False)):
        found = surface(facts, ROOM)
        assert (found.value_c, found.low_c, found.high_c) == (21.0, 19.0, 23.0)
        assert found.source == "ambient"


def test_a_default_ambient_is_called_so() -> None:
    assert "default" in surface(SurfaceFacts(), ambient(None)).why


def test_an_object_id_is_read_without_a_name() -> None:
    assert surface(SurfaceFacts(object_id="IceCube_03"), ROOM).value_c == 0.0
    assert surface(SurfaceFacts("sofa", "IceCube_03"), ROOM).source == "ambient"


@each_row(("name", "low", "high"), WORDS("warm"))
def test_a_name_gives_a_temperature(name: str, low: str, high: str) -> None:
    assert float(low) <= felt(name).value_c <= float(high)
    assert felt(name).low_c <= felt(name).value_c <= felt(name).high_c
    assert felt(name).source == "name"


# A thing that may be on or off and is not said to be on, one that is off, denials and imitations,
# false friends, `on` before a place, and states that contradict each other.
SILENT = ("on or off", "off", "denied", "false friend", "on a place", "contradiction")


@each_row(("name",), [row for table in SILENT for row in WORDS(table)])
def test_a_name_that_leaves_a_state_open_or_denies_it_gives_no_temperature(name: str) -> None:
    assert by_name(name) is None


def test_nothing_cold_is_warmer_than_the_air_and_nothing_hot_colder() -> None:
    assert felt("snowman", FROST).value_c == -12.0
    assert felt("snowman", FROST).high_c <= -9.0
    assert felt("snowman", HEAT_WAVE).value_c == 0.0
    assert felt("cold_beer", FROST).value_c == -12.0
    assert felt("hot_tub", Ambient(45.0, 44.0, 46.0, "scene")).value_c == 45.0


def test_in_hot_air_a_radiator_is_off_unless_the_name_states_on() -> None:
    assert by_name("radiator", HEAT_WAVE) is None
    assert felt("radiator_on", HEAT_WAVE).value_c == 50.0


def test_a_radiator_may_be_off_so_its_interval_reaches_down_to_the_air() -> None:
    assert felt("radiator").low_c <= ROOM.high_c


def test_why_names_the_thing_its_state_and_the_source() -> None:
    why = felt("mug_with_steam").why
    assert "mug" in why
    assert "hot" in why
    assert "from memory" in why


@pytest.mark.parametrize(("name", "end"), [("campfire", MOST_C), ("liquid_nitrogen", LEAST_C)])
def test_a_value_outside_the_wires_range_is_clamped_and_labelled(name: str, end: float) -> None:
    assert felt(name).value_c == end
    assert "clamped" in felt(name).why
    assert "clamped" not in felt("icicle").why


def test_the_scenes_own_value_is_clamped_too() -> None:
    told = stated(SurfaceFacts(stated_c=5000.0))
    assert told is not None
    assert (told.value_c, told.high_c) == (MOST_C, MOST_C)
    assert "5000" in told.why


def test_the_range_is_the_one_declared_on_the_wire() -> None:
    (declared,) = [meta for meta in get_args(messages.Celsius) if hasattr(meta, "ge")]
    assert (declared.ge, declared.le) == (LEAST_C, MOST_C)


def test_every_material_of_the_table_can_lie_in_the_sun() -> None:
    for material in materials.MATERIALS:
        found = in_sun(material)
        assert ROOM.low_c <= found.low_c < found.value_c < found.high_c
        assert 0.0 < found.value_c - ROOM.value_c < 50.0


def test_dark_asphalt_at_noon_is_as_hot_as_it_is_found_to_be() -> None:
    # 35 degC air, full sun: 60 to 70 degC is commonly measured; from memory
    asphalt = in_sun("stone", "black_asphalt_road", Ambient(35.0, 35.0, 35.0, "scene"))
    assert 55.0 <= asphalt.value_c <= 70.0
    assert asphalt.high_c >= 65.0


@each(case=cases(Path(__file__).with_name("values.json"), "sun"))
def test_the_sun_rule_is_the_published_one_for_each_material_and_shade(case: list[Any]) -> None:
    material, name, *values_c = case
    found = in_sun(material, name)
    assert [found.low_c, found.value_c, found.high_c] == pytest.approx(values_c, abs=0.01)


@pytest.mark.parametrize(
    "facts",
    [
        SurfaceFacts(material="metal", sunlit=False),
        SurfaceFacts(material="metal"),
        SurfaceFacts(material=None, sunlit=True),
        SurfaceFacts(material="unknown", sunlit=True),
        SurfaceFacts(material="my_felt", sunlit=True),
    ],
)
def test_without_sun_or_material_there_is_no_rise(facts: SurfaceFacts) -> None:
    assert sunned(facts, ROOM) is None


def test_figures_are_in_order_and_every_one_has_a_source() -> None:
    for figures in temperature_words.THINGS.values():
        for heat in figures.values():
            assert heat.low_c <= heat.value_c <= heat.high_c
            assert heat.source
            assert not 15.0 < heat.value_c < 30.0  # else it is not clear which way air bounds it


@given(st.text(max_size=60), st.floats(-60.0, 80.0))
def test_any_name_in_any_air_gives_a_temperature_within_range(name: str, air_c: float) -> None:
    found = surface(
        SurfaceFacts(name, material="metal", sunlit=True), Ambient(air_c, air_c, air_c, "vlm")
    )
    assert LEAST_C <= found.low_c <= found.value_c <= found.high_c <= MOST_C


@given(
    st.lists(st.sampled_from(sorted(temperature_words.VOCABULARY | {"with", "on", "not", "sofa"}))),
    st.floats(-60.0, 80.0),
)
def test_any_words_of_the_list_give_a_temperature_within_range(
    words: list[str], air_c: float
) -> None:
    found = surface(SurfaceFacts("_".join(words)), Ambient(air_c, air_c - 4, air_c + 4, "vlm"))
    assert LEAST_C <= found.low_c <= found.value_c <= found.high_c <= MOST_C
