"""What a name says beyond the material: kinds with bulk values of their own, and thin things."""

import math
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from each_case import each_row
from thermal_reference import Stage, skin_surface
from word_tables import words

from hapticvlm.evidence import names, sub_materials
from hapticvlm.evidence.lexicon import read_lexicon
from hapticvlm.evidence.sub_materials import PLAIN, SUB_MATERIALS, THICKNESSES, MaterialDetail
from hapticvlm.materials import MATERIALS, Thermal
from hapticvlm.rendering.heat.contact import skin_surface_c, thermal_contact

WORDS = partial(words, Path(__file__).with_name("sub_materials.csv"))
LEXICON = read_lexicon(MATERIALS)
BY_NAME = {kind.name: kind for kind in SUB_MATERIALS.values()}


def make(name: str) -> MaterialDetail:
    return sub_materials.from_name(name, LEXICON)


# Each from another source than the table's, read as docs/physics.md 1.5 names them.
@each_row(("name", "conductivity", "density", "heat_capacity", "source"), WORDS("cited"))
def test_a_sub_material_is_within_a_fifth_of_another_source(
    name: str, conductivity: str, density: str, heat_capacity: str, source: str
) -> None:
    assert source
    found = BY_NAME[name].thermal.effusivity
    cited = Thermal(*map(float, (conductivity, density, heat_capacity))).effusivity

    assert max(found / cited, cited / found) < 1.2


def test_sub_materials_differ_from_their_material_by_what_skin_can_feel() -> None:
    for name in ("styrofoam", "cork", "brick", "plaster", "concrete", "terracotta", "neoprene"):
        kind = BY_NAME[name]
        for material in kind.of:
            usual = thermal_contact(MATERIALS[material].thermal, 22.0)
            finer = thermal_contact(kind.thermal, 22.0)
            assert abs(skin_surface_c(usual, 1.0) - skin_surface_c(finer, 1.0)) > 0.4, name


@each_row(("name", "material", "kind"), WORDS("kind"))
def test_a_name_leads_to_a_sub_material(name: str, material: str, kind: str) -> None:
    assert make(name).sub_material(material) == (kind or None)


def test_denied_and_imitated_materials_do_not_count() -> None:
    for name in ("faux_brick_panel", "brick look tile", "non-copper pipe", "Cube.003", ""):
        assert not make(name).sub_materials, name
    assert make("Cube.003") is PLAIN


def test_a_sub_material_counts_for_its_own_material_only() -> None:
    felt = make("brick").refine(MATERIALS)

    assert felt["stone"].thermal == BY_NAME["brick"].thermal
    assert felt["stone"].vibration == MATERIALS["stone"].vibration
    assert all(felt[name] is MATERIALS[name] for name in MATERIALS if name != "stone")
    assert make("brick").sub_material("fabric") is None


@each_row(("name", "material", "millimetres"), WORDS("thickness"))
def test_a_name_gives_a_thickness(name: str, material: str, millimetres: str) -> None:
    metres = make(name).thickness_m.get(material)

    assert metres == (pytest.approx(1e-3 * float(millimetres)) if millimetres else None)


@pytest.mark.parametrize(
    ("name", "material"), [("leaf", "foliage"), ("sheet metal", "metal"), ("wine glass", "glass")]
)
def test_thin_things_follow_finite_differences_for_ten_seconds(name: str, material: str) -> None:
    felt = make(name)
    bulk = felt.refine(MATERIALS)[material].thermal
    contact = thermal_contact(bulk, 22.0, thickness_m=felt.thickness_m[material])
    rows = skin_surface([Stage(0.0, contact)], 10.0)
    rows = rows[rows[:, 0] > 0.01]

    off = [skin_surface_c(contact, time_s) - skin_c for time_s, skin_c in rows]
    assert rows[-1, 0] == pytest.approx(10.0)
    assert np.abs(off).max() < 0.1
    thick = thermal_contact(bulk, 22.0)
    assert skin_surface_c(contact, 10.0) - skin_surface_c(thick, 10.0) > 0.5, "it gives out"


def test_every_word_of_the_table_is_one_that_names_are_read_by() -> None:
    for table in (SUB_MATERIALS, THICKNESSES):
        for run in table:
            assert names.head_words(" ".join(run), LEXICON) == run


def test_a_word_of_a_sub_material_alone_means_one_of_its_materials() -> None:
    for run, kind in SUB_MATERIALS.items():
        evidence = names.from_name(" ".join(run), LEXICON)
        assert evidence is not None
        assert evidence.material in kind.of, run


def test_every_row_has_known_materials_and_a_source() -> None:
    thin = [kind for rows in THICKNESSES.values() for kind in rows]
    assert len(BY_NAME) >= 30
    said = [(kind.of, kind.source) for kind in BY_NAME.values()]
    said += [(kind.of, kind.source) for kind in thin]
    assert all(set(of) <= set(MATERIALS) and source for of, source in said)
    assert all(1e-5 < kind.metres < 1e-2 for kind in thin)
    assert all(math.isfinite(kind.thermal.effusivity) for kind in BY_NAME.values())
