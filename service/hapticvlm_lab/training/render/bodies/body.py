"""A body: a mesh and how it may stand. Knows no material."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from hapticvlm_lab.training.render.dice import Dice
from hapticvlm_lab.training.render.mesh import Mesh, fitted


@dataclass(frozen=True, slots=True)
class Body:
    """A mesh within radius 1 of the origin.

    upright: stands on the ground as it is, rather than lying any way round; open: its inside can be
    seen, so both sides are drawn; fills: may reach past the picture (walls, floors); walled: a thin
    wall around a hollow, for glass; companion: what belongs to it but is of another material.
    """

    mesh: Mesh
    upright: bool = False
    open: bool = False
    fills: bool = False
    walled: bool = False
    companion: Mesh | None = None


Maker = Callable[[Dice], Body]


def standing(
    mesh: Mesh, *, open_: bool = False, walled: bool = False, companion: Mesh | None = None
) -> Body:
    """Make a body that stands upright, scaled to radius 1."""
    beside = None if companion is None else fitted(mesh, companion)
    return Body(fitted(mesh), upright=True, open=open_, walled=walled, companion=beside)


def lying(mesh: Mesh, *, open_: bool = False) -> Body:
    """Make a body that may lie any way round, scaled to radius 1."""
    return Body(fitted(mesh), open=open_)
