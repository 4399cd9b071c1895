"""Names and shaders: what they imply, how surely, and when they say nothing."""

import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hapticvlm import materials
from hapticvlm.evidence.ladder import KNOWN, SURE, Evidence
from hapticvlm.evidence.names import from_name
from hapticvlm.evidence.shader import from_shader


def read(name: str) -> Evidence:
    evidence = from_name(name)
    assert evidence is not None, name
    assert evidence.rung == "name"
    return evidence


@pytest.mark.parametrize(
    ("name", "material"),
    [
        ("Oak_Table_02", "wood"),
        ("M_BrushedSteel", "metal"),
        ("Curtain.001", "fabric"),
        ("GlassPane", "glass"),
        ("SM_WoodenCrate_LOD0", "wood"),
        ("T_BrickWall_01_diff_2k", "stone"),
        ("glassware", "glass"),
        ("tablecloth", "fabric"),
        ("paper_towel", "paper"),
        ("stone washed jeans", "fabric"),
        ("fiberglass hull", "plastic"),
        ("steel wool", "metal"),
        ("rubber_plant", "foliage"),
        ("Leaves", "foliage"),
        ("kitchenKnives", "metal"),
        ("terra-cotta", "ceramic"),
        ("oaktable", "wood"),
        ("marble_tile", "stone"),
        ("carpet tile", "fabric"),
        ("gold_curtain", "fabric"),
        ("leather sofa", "leather"),
        ("cast_iron_stove", "metal"),
    ],
)
def test_a_name_with_a_class_word_is_sure(name: str, material: str) -> None:
    assert read(name).material == material
    assert read(name).confidence >= SURE


@pytest.mark.parametrize(
    ("name", "material"),
    [("kettle", "metal"), ("Sofa_03", "fabric"), ("desk", "wood"), ("jar", "glass")],
)
def test_a_thing_alone_is_believed_but_not_sure(name: str, material: str) -> None:
    assert read(name).material == material
    assert KNOWN <= read(name).confidence < SURE


@pytest.mark.parametrize(
    ("name", "material"),
    [
        ("glass table", "glass"),
        ("Table_Glass_Top", "glass"),
        ("wooden handle steel pan", "metal"),
        ("pan with wooden handle", "metal"),
        ("Wood_Table_Metal_Legs", "wood"),
        ("statue of marble", "stone"),
        ("wooden_tea_cup", "wood"),
        ("aluminium_window_frame", "metal"),
    ],
)
def test_the_head_is_distinguished_from_modifiers_and_parts(name: str, material: str) -> None:
    assert read(name).material == material


@pytest.mark.parametrize("name", ["leather-look", "faux_leather", "imitation wood", "glass-like"])
def test_an_imitation_of_a_material_is_not_that_material(name: str) -> None:
    assert read(name).confidence < KNOWN


@pytest.mark.parametrize(
    "name",
    [
        "",
        " ",
        "Material.001",
        "Cube.003",
        "lambert1",
        "Default-Material",
        "plasticine",
        "woodpecker",
        "iron_age",
        "non_metal",
        "NonMetallic",
        "no glass",
        "carpenter",
        "a" * 256,
        "7" * 256,
        "😀🪵",
        "Tisch",
        "стол",
        "ガラス",
        "bois",
        "été",
        "\u202e\u0000_-.",
    ],
)
def test_a_name_without_known_words_gives_no_evidence(name: str) -> None:
    assert from_name(name) is None


def test_a_name_of_256_characters_is_read_in_milliseconds() -> None:
    for name in ("woodtableglasspanoak" * 13, "Ab" * 128, "wood_" * 51, "s" * 256):
        start = time.process_time()  # a busy machine may take the processor away
        from_name(name[:256])
        assert time.process_time() - start < 0.05


@given(st.text(max_size=256))
def test_any_text_gives_evidence_of_known_materials_or_none(name: str) -> None:
    evidence = from_name(name)
    if evidence is not None:
        assert sum(belief for _, belief in evidence.beliefs) <= 1.0 + 1e-3
        assert {material for material, _ in evidence.beliefs} <= set(materials.MATERIALS)
        beliefs = [belief for _, belief in evidence.beliefs]
        assert beliefs == sorted(beliefs, reverse=True)


def test_a_transmissive_shader_means_glass() -> None:
    clear = from_shader(0.0, 0.05, 1.0, None)
    assert clear is not None
    assert clear.rung == "shader"
    assert (clear.material, clear.confidence < SURE) == ("glass", True)
    frosted = from_shader(None, 0.8, 0.9, None)
    assert frosted is not None
    assert KNOWN < frosted.confidence < clear.confidence


def test_a_bare_metal_shader_means_metal() -> None:
    steel = from_shader(1.0, 0.3, 0.0, (0.6, 0.6, 0.6))
    assert steel is not None
    assert (steel.material, steel.confidence >= SURE) == ("metal", True)
    black = from_shader(1.0, 0.3, None, (0.02, 0.02, 0.02))
    assert black is not None
    assert black.confidence < SURE


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
    assert from_shader(0.5, 0.5, None, None) is None
