"""Keeps which texture maps a scene uses, which were asked for, and what they showed. Pure.

A surface names its map by a hash. Within a session that is only a name: what is kept on disk is
kept by the bytes that arrive (vision/texture_verdicts.py). The service asks once for each map that
a surface has whose name and shader leave its material open, a few surfaces a tick, because to
read thousands of names would delay a touch. Many surfaces may have the same map.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import islice

from hapticvlm.evidence.ladder import Evidence
from hapticvlm.session.targets import ObjectTarget, ThingTarget

MOST = 256  # maps asked for in one session
MOST_SURFACES = 16_384  # surfaces that are followed; those beyond are decided without their maps
CHECKED = 4  # surfaces a tick whose name and shader are read
ASKED_TOGETHER = 16  # maps of one event


class Textures:
    """The maps of one scene; `most` of them are read."""

    def __init__(self, most: int = MOST) -> None:
        self._most = most
        self._texture_of: dict[ObjectTarget, str] = {}
        self._surfaces_with: dict[str, dict[ObjectTarget, None]] = {}
        self._shown: dict[str, Evidence] = {}
        self._asked: set[str] = set()
        self._unchecked: dict[ObjectTarget, None] = {}
        self._wanted: list[str] = []

    def clear(self) -> None:
        """Forget every surface; what maps showed is kept, since the next scene may use them."""
        self._texture_of.clear()
        self._surfaces_with.clear()
        self._unchecked.clear()
        self._wanted.clear()
        self._asked &= self._shown.keys()  # what was not answered may be asked for again

    def note(self, target: ObjectTarget, texture: str | None) -> None:
        """Note the map that a surface has from now on; None: it has none."""
        before = self._texture_of.pop(target, None)
        if before is not None:
            del self._surfaces_with[before][target]
            if not self._surfaces_with[before]:
                del self._surfaces_with[before]
            self._unchecked.pop(target, None)
        if texture is None or len(self._texture_of) >= MOST_SURFACES:
            return
        self._texture_of[target] = texture
        self._surfaces_with.setdefault(texture, {})[target] = None
        if texture not in self._asked:
            self._unchecked[target] = None

    def surfaces_with(self, texture: str) -> list[ObjectTarget]:
        """Return the surfaces that have this map."""
        return list(self._surfaces_with.get(texture, ()))

    def texture_of(self, target: ThingTarget) -> str | None:
        """Return the map that a surface has; None: none, or none that is known."""
        return self._texture_of.get(target) if isinstance(target, ObjectTarget) else None

    def evidence_of(self, target: ThingTarget) -> Evidence | None:
        """Return what the map of a surface showed; None where it has none, or it was not read."""
        texture = self.texture_of(target)
        return None if texture is None else self._shown.get(texture)

    def may_read(self, texture: str) -> bool:
        """Whether one more map may be read in this session."""
        return texture in self._asked or len(self._asked) < self._most

    def add(self, texture: str, evidence: Evidence) -> None:
        """Receive what a map showed."""
        if self.may_read(texture):
            self._asked.add(texture)
            self._shown[texture] = evidence

    def next_wanted(self, is_open: Callable[[ObjectTarget], bool]) -> list[str]:
        """Check some more surfaces; return the maps to ask for now, none of them twice.

        `is_open`: whether names and shader leave the material of a surface open.
        """
        for target in list(islice(self._unchecked, CHECKED)):
            del self._unchecked[target]
            texture = self._texture_of[target]
            if texture not in self._asked and self.may_read(texture) and is_open(target):
                self._asked.add(texture)
                self._wanted.append(texture)
        if self._unchecked and len(self._wanted) < ASKED_TOGETHER:
            return []
        wanted, self._wanted = self._wanted, []
        return wanted
