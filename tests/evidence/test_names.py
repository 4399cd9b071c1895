"""Names and shaders: what they imply, how surely, and when they say nothing."""

import time
from functools import partial
from pathlib import Path

import pytest
from each_case import each, each_row
from hypothesis import given
from hypothesis import strategies as st
from word_tables import words

from hapticvlm import materials
from hapticvlm.evidence.ladder import KNOWN, SURE, Evidence
from hapticvlm.evidence.names import from_name
from hapticvlm.evidence.shader import from_shader

WORDS = partial(words, Path(__file__).with_name("names.csv"))


def read(name: str) -> Evidence:
    evidence = from_name(name)
    assert evidence is not None, name
    assert evidence.rung == "name"
    return evidence


# No known word, a word of engines (alone, or with a thing), a head that is no thing whatever stands
# before it, a controller of something, and parents that take the meaning.
NO_EVIDENCE = ("nothing", "engine", "engine alone", "no thing", "controller", "parent takes")
# How surely a name of each table says its material: from, below.
SURENESS = {
    "sure": (SURE, 1.1),  # a class word
    "alone": (KNOWN, SURE),  # a thing
    "before unknown": (KNOWN, SURE),  # a class word before an unknown word
    "head": (0.0, 1.1),  # apart from modifiers and parts
    "neutral": (KNOWN, 1.1),  # beside words that say nothing of a material
    "parent": (KNOWN, 1.1),  # parents give the sense or the thing
    "thing": (KNOWN, 1.1),  # of streets, sports, weapons and machines
    "language": (KNOWN, 1.1),  # common words of eight other languages
}


@each_row(
    ("table", "name", "material"), [(table, *row) for table in SURENESS for row in WORDS(table)]
)
def test_a_name_says_its_material_as_surely_as_words_of_its_kind_do(
    table: str, name: str, material: str
) -> None:
    least, below = SURENESS[table]
    assert read(name).material == material
    assert least <= read(name).confidence < below


@each_row(("name",), WORDS("doubtful"))
def test_an_imitation_or_a_thing_before_an_unknown_word_is_not_believed(name: str) -> None:
    assert read(name).confidence < KNOWN


@each(
    name=[
        *(name for table in NO_EVIDENCE for (name,) in WORDS(table)),
        *("a" * 256, "7" * 256, "\u202e\u0000_-."),
    ]
)
def test_what_says_nothing_gives_no_evidence(name: str) -> None:
    assert from_name(name) is None


@pytest.mark.parametrize("name", ["MotionController", "LeftController", "VR_Controller_White"])
def test_a_controller_in_the_hand_is_plastic(name: str) -> None:
    assert read(name).material == "plastic"


def test_a_name_of_256_characters_is_read_in_milliseconds() -> None:
    names = (
        "woodtableglasspanoak" * 13,
        "Ab" * 128,
        "wood_" * 51,
        "s" * 256,
        "a/" * 128,
        "木の" * 128,
    )
    for name in names:
        start = time.process_time()  # a busy machine may take the processor away
        from_name(name[:256])
        assert time.process_time() - start < 0.05


def test_a_parent_is_believed_less_than_its_own_name() -> None:
    assert read("Crate/Visuals").confidence < read("Crate").confidence


@each_row(("name", "surface", "material"), WORDS("surface"))
def test_the_name_of_a_surface_says_more_than_that_of_its_object(
    name: str, surface: str, material: str
) -> None:
    evidence = from_name(name, surface=surface)
    assert evidence is not None
    assert (evidence.material, evidence.confidence >= SURE) == (material, True)


def test_a_surface_that_agrees_or_says_nothing_changes_no_belief() -> None:
    assert from_name("Sofa_03", surface="mat7") == from_name("Sofa_03")
    agreed = from_name("OakDesk", surface="Desk_03")
    assert agreed == from_name("OakDesk")


@pytest.mark.parametrize(
    ("name", "material"), [("Hose", "rubber"), ("Coin", "metal"), ("Gift", None), ("Pot", None)]
)
def test_english_wins_over_words_of_other_languages(name: str, material: str | None) -> None:
    evidence = from_name(name)
    said = evidence.material if evidence and evidence.confidence >= KNOWN else None
    assert said == material


@pytest.mark.parametrize("name", ["木星", "石油会社"])
def test_a_word_without_spaces_that_ends_unknown_is_not_sure(name: str) -> None:
    assert read(name).confidence < SURE


@given(st.text(max_size=256))
def test_any_text_gives_evidence_of_known_materials_or_none(name: str) -> None:
    evidence = from_name(name)
    if evidence is not None:
        assert sum(belief for _, belief in evidence.beliefs) <= 1.0 + 1e-3
        assert {material for material, _ in evidence.beliefs} <= set(materials.MATERIALS)
        beliefs = [belief for _, belief in evidence.beliefs]
        assert beliefs == sorted(beliefs, reverse=True)


@each_row(("name", "material"), WORDS("part"))
def test_a_part_is_of_what_its_whole_or_its_place_is_made_of(name: str, material: str) -> None:
    evidence = from_name(name)
    said = evidence.material if evidence and evidence.confidence >= KNOWN else "none"
    assert said == material


def test_a_transmissive_shader_means_glass() -> None:
    clear = from_shader(0.0, 0.05, 1.0, None)
    assert clear is not None
    assert clear.rung == "shader"
    assert (clear.material, clear.confidence < SURE) == ("glass", True)
    frosted = from_shader(None, 0.8, 0.9, None)
    assert frosted is not None
    assert KNOWN < frosted.confidence < clear.confidence


def test_a_thin_blended_surface_may_be_glass_and_an_opaque_or_metallic_one_is_not() -> None:
    for opacity, metallic, material in ((0.3, 0.0, "glass"), (0.3, 1.0, "metal")):
        evidence = from_shader(metallic, 0.1, None, None, opacity)
        assert evidence is not None
        assert evidence.material == material
    pane = from_shader(None, None, 0.0, None, 0.3)
    assert pane is not None
    assert KNOWN <= pane.confidence < SURE
    for unclear in (None, 0.0, 1.0):
        assert from_shader(None, None, None, None, unclear) is None


def test_a_bare_metal_shader_means_metal() -> None:
    steel = from_shader(1.0, 0.3, 0.0, (0.6, 0.6, 0.6))
    assert steel is not None
    assert (steel.material, steel.confidence >= SURE) == ("metal", True)
    black = from_shader(1.0, 0.3, None, (0.02, 0.02, 0.02))
    assert black is not None
    assert black.confidence < SURE


def test_metal_is_believed_by_degree_and_nothing_is_said_of_what_lies_between() -> None:
    said = {
        value: from_shader(value, 0.3, None, (0.6, 0.6, 0.6)) for value in (0.5, 0.7, 0.9, 0.95)
    }
    beliefs = {value: evidence.confidence for value, evidence in said.items() if evidence}
    assert beliefs == pytest.approx({0.5: 0.6, 0.7: 0.8, 0.9: 0.9, 0.95: 0.9})
    assert from_shader(0.83, 0.3, None, None).material == "metal"  # type: ignore[union-attr]
    for value in (0.11, 0.25, 0.4):
        assert from_shader(value, 0.3, None, None) is None


@pytest.mark.parametrize("roughness", [None, 1.0])
def test_gltf_defaults_give_no_evidence(roughness: float | None) -> None:
    assert from_shader(1.0, roughness, None, (1.0, 1.0, 1.0)) is None


def test_a_dielectric_shader_only_speaks_against_metal() -> None:
    plain = from_shader(0.0, 0.5, None, None)
    assert plain is not None
    assert plain.confidence < 0.2
    assert plain.beliefs[-1][0] == "metal"


def test_missing_parameters_give_no_evidence() -> None:
    assert from_shader(None, None, None, None) is None
    assert from_shader(None, 0.2, 0.0, (1.0, 0.0, 0.0)) is None
    assert from_shader(0.3, 0.5, None, None) is None
