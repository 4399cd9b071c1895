"""The objects of the set: ids, truths, shapes and their surfaces. Depends on no data.

Within a class the shapes are the class's own models in their own textures, then models that every
opaque class wears, then the common shapes in turn: but for leaves, no shape belongs to one class.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import zip_longest

from hapticvlm import materials
from hapticvlm_lab.training.held_back.shapes import COMMON

MAIN = ("wood", "glass", "fabric", "metal")
MAIN_COUNT = 40
FURTHER_COUNT = 10
UNKNOWN_COUNT = 40
ORBIT_FRAMES = 75

# Models in the textures they came with; left out are those that show another material than their
# label says (sofa_03: leather; Dumbbell_01: rubber) or are many small things (tea_set_01).
OWN: dict[str, tuple[str, ...]] = {
    "wood": (
        *("painted_wooden_cabinet", "painted_wooden_cabinet_02", "painted_wooden_stool"),
        *("wooden_bookshelf_worn", "wooden_table_02", "CoffeeTable_01", "ReadingDesk_01"),
        *("ShoeRack_01", "TVCabinet_01", "Door_01"),
    ),
    "fabric": ("curtain_open", "Curtain_01", "Pillow_01", "Quilt_01", "SofaB_01"),
    "metal": ("Rangehood_01", "Handle_01", "FitnessEquipment_01"),
    "ceramic": ("Tableware_01", "Vase_01"),
}
# Models with a new surface, of any class; the first few in classes of few objects.
SHARED = (
    *("Vase_01", "Tableware_01", "Pillow_01", "painted_wooden_stool", "CoffeeTable_01"),
    "ReadingDesk_01",
)
SHARED_OF_GLASS = ("Vase_01", "Tableware_01", "Handle_01", "Dumbbell_01")
SHARED_OF_UNKNOWN = ("Pillow_01",)
# What skin, soil, food and liquids may have.
_SOFT = ("lump", "ball", "cushion", "drape", "crumpled", "bar", "bowl", "slab", "cylinder", "box")
_ORBIT_SHAPES = {"wood": "vase", "glass": "vase", "fabric": "cushion", "metal": "bowl"}


@dataclass(frozen=True, slots=True)
class Plan:
    """One object; `own` keeps the model's textures, `number` counts within its class."""

    object_id: str
    truth: str
    number: int
    shape: str
    is_model: bool
    own: bool


def approaches() -> list[Plan]:
    """List the objects of the approach set, classes taking turns."""
    classes = [_class(name, _count(name)) for name in (*materials.MATERIALS, materials.UNKNOWN)]
    return [plan for turn in zip_longest(*classes) for plan in turn if plan is not None]


def orbits() -> list[Plan]:
    """List the objects of the orbit set, one of each main class."""
    return [
        Plan(f"{name}_orbit", name, 0, shape, is_model=False, own=False)
        for name, shape in _ORBIT_SHAPES.items()
    ]


def _count(name: str) -> int:
    if name == materials.UNKNOWN:
        return UNKNOWN_COUNT
    return MAIN_COUNT if name in MAIN else FURTHER_COUNT


def _class(name: str, count: int) -> list[Plan]:
    """Mix own models, shared models and common shapes evenly over the numbers."""
    own = [(shape, True, True) for shape in OWN.get(name, ())[: count // 3]]
    shared = [(shape, True, False) for shape in _shared(name)[: count // 7 + 1]]
    start = 3 * sorted((*materials.MATERIALS, materials.UNKNOWN)).index(name)
    rest = count - len(own) - len(shared)
    common = [(_common(name, start + turn), False, False) for turn in range(rest)]
    spread = sorted(
        [
            (place / len(kind), index)
            for kind in (own, shared, common)
            for place, index in enumerate(kind)
        ],
        key=lambda pair: pair[0],
    )
    return [
        Plan(f"{name}_{number:03d}", name, number, shape, is_model, is_own)
        for number, (_, (shape, is_model, is_own)) in enumerate(spread)
    ]


def _shared(name: str) -> tuple[str, ...]:
    if name == materials.UNKNOWN:
        return SHARED_OF_UNKNOWN
    return SHARED_OF_GLASS if name == "glass" else SHARED


def _common(name: str, turn: int) -> str:
    if name == "foliage" and turn % 2 == 0:
        return "leaves"
    pool = _SOFT if name == materials.UNKNOWN else COMMON
    return pool[turn % len(pool)]
