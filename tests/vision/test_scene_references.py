"""The named objects of a scene teach about its unnamed ones, bounded, and about no other scene."""

import numpy as np
import pytest

from hapticvlm.evidence.ladder import Evidence
from hapticvlm.vision.scene_references import MAX_OBJECTS, SceneReferences

UNDECIDED = Evidence("encoder", (("glass", 0.4), ("metal", 0.4)))


def unit(*numbers: float) -> np.ndarray:
    row = np.array(numbers, np.float32)
    return row / np.linalg.norm(row)


def taught(objects: int) -> SceneReferences:
    """A scene whose glass looks one way and whose metal another, alike in all else."""
    references = SceneReferences()
    for number in range(objects):
        name = ("glass", "metal")[number % 2]
        look = (0.3, 0.0) if name == "glass" else (0.0, 0.3)
        references.add(f"{name} {number}", name, unit(1.0, *look, 0.01 * number))
    return references


def test_an_object_like_the_named_glass_of_the_scene_is_glass() -> None:
    found = dict(taught(6).adjust(UNDECIDED, unit(1.0, 0.25, 0.02, 0.0), "x").beliefs)
    assert found["glass"] > 0.6 > 0.2 > found["metal"]
    other = dict(taught(6).adjust(UNDECIDED, unit(1.0, 0.02, 0.25, 0.0), "x").beliefs)
    assert other["metal"] > 0.6


def test_more_named_objects_count_for_more() -> None:
    shown = unit(1.0, 0.25, 0.02, 0.0)
    found = [dict(taught(n).adjust(UNDECIDED, shown, "x").beliefs)["glass"] for n in (2, 6, 30)]
    assert found == sorted(found)
    assert found[2] - found[0] > 0.1


def test_references_count_for_more_where_the_picture_has_flat_colours() -> None:
    shown = unit(1.0, 0.16, 0.1, 0.0)
    plain, flat = (
        dict(taught(6).adjust(UNDECIDED, shown, "x", is_flat=flat).beliefs)["glass"]
        for flat in (False, True)
    )
    assert 0.5 < plain < flat - 0.05
    lone = SceneReferences()
    lone.add("cup", "glass", unit(1.0, 0.3, 0.0))
    assert lone.adjust(UNDECIDED, shown, "x", is_flat=True) == UNDECIDED


def test_an_object_is_not_its_own_reference_and_one_object_is_too_few() -> None:
    references = SceneReferences()
    references.add("cup", "glass", unit(1.0, 0.3, 0.0))
    references.add("pan", "metal", unit(1.0, 0.0, 0.3))
    shown = unit(1.0, 0.3, 0.0)
    assert references.adjust(UNDECIDED, shown, "cup") == UNDECIDED
    assert references.adjust(UNDECIDED, shown, "jug") != UNDECIDED


def test_the_references_of_a_scene_are_bounded() -> None:
    references = SceneReferences()
    for number in range(MAX_OBJECTS + 1):
        references.add(str(number), "glass" if number else "metal", unit(1.0, number % 7))
    adjusted = references.adjust(UNDECIDED, unit(1.0, 1.0), None)
    ratio = dict(adjusted.beliefs)
    assert ratio["glass"] != pytest.approx(ratio["metal"])


def test_the_open_mass_stays_open() -> None:
    adjusted = taught(6).adjust(UNDECIDED, unit(1.0, 0.25, 0.02, 0.0), "x")
    assert 0.9 < 1.0 - (1.0 - sum(p for _, p in adjusted.beliefs)) / 2 < 1.0
