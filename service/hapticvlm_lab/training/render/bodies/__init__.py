"""What a material takes shape as: a body for a sample, drawn from those its class is seen as."""

from __future__ import annotations

from hapticvlm_lab.training.render.bodies import furniture, leaves, made, sheets, solids, vessels
from hapticvlm_lab.training.render.bodies.body import Body, Maker
from hapticvlm_lab.training.render.dice import Dice

_ANY: tuple[tuple[Maker, float], ...] = (
    (solids.box, 2),
    (solids.rounded, 2),
    (solids.ball, 2),
    (solids.cylinder, 2),
    (solids.blob, 1.5),
    (solids.torus, 1),
    (solids.capsule, 0.7),
    (furniture.slab, 3),
    (furniture.wall, 3),
)
_SHAPES: dict[str, tuple[tuple[Maker, float], ...]] = {
    "wood": (
        *_ANY,
        (made.boards, 3),
        (furniture.table, 3),
        (furniture.crate, 2),
        (furniture.frame, 1),
        (made.rods, 1.5),
        (vessels.bowl, 1),
        (furniture.shelf, 1.5),
        (furniture.chair, 3),
        (made.gear, 0.7),
    ),
    "glass": (
        (vessels.bottle, 3),
        (vessels.tumbler, 3),
        (vessels.vase, 2),
        (vessels.bowl, 1.5),
        (vessels.wineglass, 2),
        (furniture.pane, 4),
        (solids.ball, 2),
        (solids.box, 1),
        (solids.rounded, 1),
        (solids.cylinder, 1),
        (solids.torus, 0.7),
        (solids.blob, 0.7),
    ),
    "fabric": (
        (sheets.curtain, 3),
        (sheets.tablecloth, 2.5),
        (sheets.cushion, 3),
        (sheets.rug, 2),
        (sheets.draped, 2),
        (sheets.folded, 2),
        (furniture.wall, 2),
        (furniture.slab, 1),
        (furniture.seat, 2),
        (solids.ball, 1),
        (solids.rounded, 1.5),
        (solids.blob, 1),
        (sheets.flag, 1.5),
        (sheets.garment, 3),
    ),
    "metal": (
        *_ANY,
        (made.rods, 2),
        (vessels.bowl, 1.5),
        (vessels.can, 2),
        (vessels.vase, 1),
        (vessels.pot, 1.5),
        (sheets.corrugated, 1),
        (furniture.table, 1),
        (made.rings, 1),
        (made.cutlery, 1.5),
        (made.pan, 2),
        (made.gear, 2),
        (furniture.chair, 1),
        (furniture.frame, 0.7),
        (furniture.shelf, 0.7),
        (made.tube, 1),
    ),
    "plastic": (
        *_ANY,
        (vessels.bottle, 2),
        (vessels.tumbler, 1.5),
        (vessels.bowl, 1),
        (furniture.crate, 1),
        (furniture.seat, 1),
        (made.tube, 1),
        (made.toy, 2),
        (furniture.chair, 1.5),
        (made.gear, 1),
        (made.rods, 0.7),
    ),
    "stone": (
        *_ANY,
        (solids.rock, 5),
        (solids.pebbles, 2),
        (made.blocks, 2),
        (vessels.column, 1.5),
        (furniture.table, 0.7),
    ),
    "ceramic": (
        (vessels.vase, 3),
        (vessels.bowl, 3),
        (vessels.plate, 2),
        (vessels.mug, 3),
        (vessels.pot, 2),
        (solids.blob, 1.5),
        (furniture.slab, 2),
        (furniture.wall, 3),
        (solids.ball, 1),
        (solids.rounded, 1),
    ),
    "paper": (
        (sheets.sheet, 3),
        (sheets.crumpled, 3),
        (made.stack, 3),
        (made.carton, 3),
        (made.tube, 1),
        (furniture.wall, 1.5),
        (furniture.slab, 1),
        (solids.box, 1.5),
        (sheets.folded, 0.7),
    ),
    "leather": (
        (sheets.cushion, 3),
        (furniture.seat, 3),
        (solids.rounded, 2),
        (sheets.draped, 1.5),
        (furniture.wall, 2),
        (furniture.slab, 1.5),
        (made.bag, 2),
        (solids.ball, 1),
        (sheets.folded, 1),
        (made.strap, 1.5),
    ),
    "rubber": (
        (made.tyre, 3),
        (solids.ball, 2),
        (made.tube, 2),
        (solids.torus, 1.5),
        (furniture.slab, 2),
        (furniture.wall, 1.5),
        (solids.rounded, 1.5),
        (solids.blob, 1.5),
        (made.strap, 1.5),
        (solids.capsule, 1),
    ),
    "foliage": (
        (leaves.bush, 4),
        (leaves.grass, 3),
        (leaves.branch, 3),
        (leaves.leaf, 2),
        (furniture.slab, 2),
        (furniture.wall, 1),
        (solids.blob, 1),
    ),
}


def body(dice: Dice, material: str) -> Body:
    """Make a body of a class, centred, radius 1; of no particular use when the class is unknown."""
    maker = dice.weigh(_SHAPES.get(material, _ANY))
    return maker(dice)


def clutter(dice: Dice) -> Body:
    """Something to stand around: cheap shapes."""
    return dice.weigh(_ANY[:7])(dice)


def stick(dice: Dice) -> Body:
    """Something slender, to stand in front."""
    return dice.weigh(((made.rods, 1.0), (solids.capsule, 2.0), (solids.box, 1.0)))(dice)
