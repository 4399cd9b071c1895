"""Tests the tables of `feel.json`: their size, their schema, and that nothing is lost in them."""

from __future__ import annotations

import base64
import json
from dataclasses import replace
from pathlib import Path

import jsonschema
import msgspec
import numpy as np
import pytest
from numpy.typing import NDArray

from hapticvlm.materials import MATERIALS, Mode
from hapticvlm.rendering.vibration import loops
from hapticvlm.rendering.vibration.feel_tables import (
    DRAWS,
    SEEDS,
    LoopTable,
    encode,
    feel,
    left_out,
)

ROOT = Path(__file__).parents[2]
MAX_BYTES_OF_MATERIAL = 60_000
MAX_BYTES = 400_000
FEEL = feel(MATERIALS)


def test_the_tables_of_a_material_and_of_all_materials_are_small() -> None:
    for name, tables in FEEL.materials.items():
        assert len(msgspec.json.encode(tables)) <= MAX_BYTES_OF_MATERIAL, name
    assert len(encode(FEEL)) <= MAX_BYTES


def test_the_same_materials_in_any_order_give_the_same_bytes() -> None:
    turned = {name: MATERIALS[name] for name in sorted(MATERIALS, reverse=True)}
    assert encode(feel(turned)) == encode(FEEL)


def test_the_tables_keep_their_schema() -> None:
    schema = json.loads((ROOT / "schemas/feel.schema.json").read_text())
    jsonschema.Draft202012Validator(schema).validate(json.loads(encode(FEEL)))


@pytest.mark.parametrize("name", ["metal", "stone"])
def test_a_loop_is_restored_from_its_bytes_within_a_hundredth(name: str) -> None:
    facts = MATERIALS[name].vibration
    loop = loops.noise(facts.bandwidth, facts.roughness)
    places = np.random.default_rng(0).random(2000)
    wanted = loop.read(places * loop.size)
    restored = between(unpacked(FEEL.materials[name].slide.loop), places)
    assert np.sqrt(np.mean((restored - wanted) ** 2)) < 0.01


def test_the_draws_are_those_of_the_services_generator() -> None:
    drawn = np.frombuffer(base64.b64decode(FEEL.draws), "<u2").reshape(SEEDS, DRAWS)
    wanted = np.random.default_rng(7).random(DRAWS)
    assert np.abs((drawn[7] + 0.5) / 65_536 - wanted).max() <= 1 / 65_536


def test_a_material_that_rings_above_the_band_is_named_as_left_out() -> None:
    assert left_out(MATERIALS) == []
    wood = MATERIALS["wood"]
    shrill = replace(wood.vibration, modes=(Mode(900.0, 250.0, 1.0),))
    (sentence,) = left_out({"wood": wood, "bell": replace(wood, name="bell", vibration=shrill)})
    assert "bell" in sentence


def test_what_does_not_yield_or_is_too_hard_to_carve_has_null_and_no_number() -> None:
    assert FEEL.materials["stone"].press_n_per_grain is None
    assert FEEL.materials["rubber"].press_n_per_grain == pytest.approx(0.75)
    assert FEEL.materials["glass"].carve.fibre_m is None
    assert FEEL.materials["wood"].carve.fibre_m == pytest.approx(0.004)


def unpacked(table: LoopTable) -> NDArray[np.float64]:
    packed = np.frombuffer(base64.b64decode(table.wave), np.int8)
    return packed.astype(np.float64) * table.step


def between(wave: NDArray[np.float64], places: NDArray[np.float64]) -> NDArray[np.float64]:
    """Values of a loop at places (N,) 0..1, by the cubic of the players."""
    at = places * wave.size
    whole = at.astype(int)
    t = at - whole
    a, b, c, d = (wave[(whole + offset) % wave.size] for offset in (-1, 0, 1, 2))
    value = b + 0.5 * t * (c - a + t * (2 * a - 5 * b + 4 * c - d + t * (3 * (b - c) + d - a)))
    return np.asarray(value)
