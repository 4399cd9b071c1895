"""Names and shaders: what they imply, how surely, and when they say nothing."""

import time
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from each_case import each, each_row
from hypothesis import given
from hypothesis import strategies as st
from word_tables import cases, words

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
    ("name", "surface", "material"),
    [
        ("Desk", "Gold", "metal"),
        ("Bench", "Earth", "stone"),
        ("Desk", "Red", "wood"),
        ("Drawers_02", "Drawers_Metallic", "metal"),
    ],
)
def test_a_metal_or_soil_of_a_surface_says_more_than_what_its_object_is_usually_of(
    name: str, surface: str, material: str
) -> None:
    evidence = from_name(name, surface=surface)
    assert evidence is not None
    assert evidence.material == material


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


@each(case=cases(Path(__file__).with_name("values.json"), "shaders"))
def test_a_shader_implies_what_the_table_says(case: list[Any]) -> None:
    _, *parameters, beliefs = case
    evidence = from_shader(*parameters)
    assert (evidence is None) is (beliefs is None)
    if evidence is not None:
        assert evidence.rung == "shader"
        assert evidence.material == next(iter(beliefs))
        assert {name: dict(evidence.beliefs)[name] for name in beliefs} == beliefs
