"""What a material takes shape as: a body for a sample, drawn from those its class is seen as."""

from __future__ import annotations

from hapticvlm.training.render.bodies import leaves, made, sheets, solids, vessels
from hapticvlm.training.render.bodies.body import Body, Maker
from hapticvlm.training.render.dice import Dice

_ANY: tuple[tuple[Maker, float], ...] = (
    (solids.box, 2),
    (solids.rounded, 2),
    (solids.ball, 2),
    (solids.cylinder, 2),
    (solids.blob, 1.5),
    (solids.torus, 1),
    (solids.capsule, 0.7),
    (made.slab, 3),
    (made.wall, 3),
)
_SHAPES: dict[str, tuple[tuple[Maker, float], ...]] = {
    "wood": (
        *_ANY,
        (made.boards, 3),
        (made.table, 3),
        (made.crate, 2),
        (made.frame, 1),
        (made.rods, 1.5),
        (vessels.bowl, 1),
        (made.shelf, 1.5),
    ),
    "glass": (
        (vessels.bottle, 3),
        (vessels.tumbler, 3),
        (vessels.vase, 2),
        (vessels.bowl, 1.5),
        (vessels.wineglass, 2),
        (made.pane, 4),
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
        (made.wall, 2),
        (made.slab, 1),
        (made.seat, 2),
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
        (made.table, 1),
        (made.rings, 1),
        (made.cutlery, 1),
        (made.tube, 1),
    ),
    "plastic": (
        *_ANY,
        (vessels.bottle, 2),
        (vessels.tumbler, 1.5),
        (vessels.bowl, 1),
        (made.crate, 1),
        (made.seat, 1),
        (made.tube, 1),
        (made.toy, 2),
        (made.rods, 0.7),
    ),
    "stone": (
        *_ANY,
        (solids.rock, 5),
        (solids.pebbles, 2),
        (made.blocks, 2),
        (vessels.column, 1.5),
        (made.table, 0.7),
    ),
    "ceramic": (
        (vessels.vase, 3),
        (vessels.bowl, 3),
        (vessels.plate, 2),
        (vessels.mug, 3),
        (vessels.pot, 2),
        (solids.blob, 1.5),
        (made.slab, 2),
        (made.wall, 3),
        (solids.ball, 1),
        (solids.rounded, 1),
    ),
    "paper": (
        (sheets.sheet, 3),
        (sheets.crumpled, 3),
        (made.stack, 3),
        (made.carton, 3),
        (made.tube, 1),
        (made.wall, 1.5),
        (made.slab, 1),
        (solids.box, 1.5),
        (sheets.folded, 0.7),
    ),
    "leather": (
        (sheets.cushion, 3),
        (made.seat, 3),
        (solids.rounded, 2),
        (sheets.draped, 1.5),
        (made.wall, 2),
        (made.slab, 1.5),
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
        (made.slab, 2),
        (made.wall, 1.5),
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
        (made.slab, 2),
        (made.wall, 1),
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
