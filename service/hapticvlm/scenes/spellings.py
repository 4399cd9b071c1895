"""Spells names of a glTF file's nodes as engines do, so that clients find theirs in a bake. Pure.

glTF lets names be of any letters, the same twice, or absent. Each loader rewrites them:

- three.js (GLTFLoader) turns blanks to `_`, takes `[ ] . : /` out, and numbers what is the same
  then: `_1`, `_2`. Scenes and nodes are named first, from the roots on, meshes after them.
- Godot (GLTFDocument) turns `. : @ / " %` to `_`, numbers from 2 without a joint, by the order of
  the file, and takes an ending that has a meaning (`-col`, `-rigid`) away.
- Babylon.js and Unity's loaders keep names. Babylon calls a nameless node `node` and its number;
  Unity's client turns `Node-3` of glTFast and `GLTFNode3` of UnityGLTF to that.
- glTFast, where it makes names unique, numbers siblings of one name: the second one `_0`.

A lower level of detail (MSFT_lod) has the paths of the node that it stands for. Babylon.js
loads levels that no scene has; three.js and Godot do not.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from hapticvlm.scenes import gltf
from hapticvlm.scenes.lookup import AS_THE_SCENE

_THREE_OUT = re.compile(r"[\[\].:/]")
_BLANK = re.compile(r"\s")
_GODOT_OUT = re.compile(r'[.:@/"%]')
_HINTS = (
    *("noimp", "col", "convcol", "colonly", "convcolonly", "navmesh", "occ", "occonly"),
    *("rigid", "vehicle", "wheel", "loop", "cycle"),
)
_GODOT_HINT = re.compile(rf"[-$_](?:{'|'.join(_HINTS)})$", re.IGNORECASE)
DEEPEST = 4  # names of a path: its own and those of its nearest parents
_HIGHEST = 16  # parents that are asked for a name


Names = tuple[tuple[str, ...], ...]  # of each node; one may have none, or several


@dataclass(frozen=True, slots=True)
class Spellings:
    """The names of each node by engine; `scene` are those of the file."""

    engines: Mapping[str, Names]
    parents: tuple[int | None, ...]
    lower: Mapping[int, tuple[int, ...]]  # levels of detail that stand for a node

    def paths(self, node: int) -> dict[str, tuple[str, ...]]:
        """Return the paths of a node by engine, without those that are as in the file."""
        above: list[int] = []
        at = self.parents[node]
        while at is not None and len(above) < _HIGHEST:
            above.append(at)
            at = self.parents[at]
        paths = {
            engine: tuple(
                "/".join((*_first(names, above), own))
                for level in (node, *self.lower.get(node, ()))
                for own in names[level]
            )
            for engine, names in self.engines.items()
        }
        kept = paths.pop(AS_THE_SCENE)
        others = {engine: each for engine, each in paths.items() if each != kept}
        return {AS_THE_SCENE: kept, **others}


def _first(names: Names, nodes: Sequence[int]) -> list[str]:
    return [names[each][0] for each in nodes if names[each]][: DEEPEST - 1][::-1]


def spellings(document: gltf.Document) -> Spellings:
    """Return the spellings of all nodes that the scenes of a document reach."""
    nodes = document.nodes
    parents: list[int | None] = [None] * len(nodes)
    for index, node in enumerate(nodes):
        for child in node.children:
            if child < len(nodes) and child != index and parents[child] is None:
                parents[child] = index
    engines = {
        AS_THE_SCENE: _kept(document),
        "gltfast": _numbered_siblings(document),
        "three": _three(document, parents),
        "godot": _godot(document),
    }
    return Spellings(engines, tuple(parents), _levels(document, parents))


def _levels(document: gltf.Document, parents: Sequence[int | None]) -> dict[int, tuple[int, ...]]:
    """Return the lower levels of detail of each node with a mesh, and those that they have.

    A node that the other one is below is no level of it. What no other node names comes first, so
    that a level has none of its own; of nodes that name each other the first one is felt.
    """
    nodes = document.nodes
    lods = {index: node.extensions.lod.ids for index, node in enumerate(nodes)}
    originals = [index for index, ids in lods.items() if ids and nodes[index].mesh is not None]
    if not originals:
        return {}
    begin, end = _spans(document, parents)
    named = {each for index in originals for each in lods[index]}
    lower: set[int] = set()
    levels: dict[int, tuple[int, ...]] = {}
    for index in sorted(originals, key=lambda each: (each in named, each)):
        own = []
        waiting = [] if index in lower else list(lods[index])
        while waiting:
            level = waiting.pop()
            if level in lower or level not in lods or begin[level] <= begin[index] < end[level]:
                continue
            lower.add(level)
            own.append(level)
            waiting += lods[level]
        if own:
            levels[index] = tuple(sorted(own))
    return levels


def _spans(
    document: gltf.Document, parents: Sequence[int | None]
) -> tuple[Sequence[int], Sequence[int]]:
    """Return the place of each node in an order from the roots on, and that behind what is below.

    One node is above another, or the same, if the other's place is in its span.
    """
    begin = [0] * len(parents)
    end = [0] * len(parents)
    place = 0
    waiting = sorted(range(len(parents)), key=lambda index: parents[index] is None)
    while waiting:  # roots are at its end; then only nodes that are below themselves are left
        index = waiting.pop()
        if index < 0:
            end[~index] = place + 1
        elif not begin[index]:
            place += 1
            begin[index] = place
            children = document.nodes[index].children
            waiting += (~index, *(each for each in children if each < len(parents)))
    return begin, end


def _kept(document: gltf.Document) -> Names:
    return tuple(
        (node.name,) if node.name else (*_mesh_names(document, node), f"node{index}")
        for index, node in enumerate(document.nodes)
    )


def _mesh_names(document: gltf.Document, node: gltf.Node) -> tuple[str, ...]:
    if node.mesh is None or node.mesh >= len(document.meshes):
        return ()
    name = document.meshes[node.mesh].name
    return (name,) if name else ()


def _numbered_siblings(document: gltf.Document) -> Names:
    names = list(kept := _kept(document))
    families = (*(n.children for n in document.nodes), *(s.nodes for s in document.scenes))
    for family in families:
        numbers: dict[str, int] = {}
        for index in family:
            if index < len(names):
                name, *others = kept[index]
                longer = name
                while longer in numbers:
                    longer = f"{name}_{numbers[name]}"
                    numbers[name] += 1
                numbers[longer] = 0
                names[index] = (longer, *others)
    return tuple(names)


def _three(document: gltf.Document, parents: Sequence[int | None]) -> Names:
    unique = _Numbered()
    nodes = document.nodes
    names: list[tuple[str, ...]] = [()] * len(nodes)
    order: list[int] = []
    for index in _from_the_roots(document, parents, unique):
        order.append(index)
        name = nodes[index].name
        if name:
            names[index] = (unique(name),)
    parts: dict[int, tuple[str, ...]] = {}  # names of a mesh's primitives
    for index in order:
        mesh = nodes[index].mesh
        if mesh is None or mesh >= len(document.meshes):
            continue
        if mesh not in parts:
            each = document.meshes[mesh]
            parts[mesh] = tuple(unique(each.name or f"mesh_{mesh}") for _ in each.primitives)
        names[index] = names[index] or parts[mesh]
    return tuple(names)


class _Numbered:
    """Spells a name as three.js does, and numbers it where it was there before."""

    def __init__(self) -> None:
        self._used: dict[str, int] = {}

    def __call__(self, name: str) -> str:
        name = _THREE_OUT.sub("", _BLANK.sub("_", name))
        if name not in self._used:
            self._used[name] = 0
            return name
        self._used[name] += 1
        return f"{name}_{self._used[name]}"


def _from_the_roots(
    document: gltf.Document, parents: Sequence[int | None], unique: _Numbered
) -> Iterator[int]:
    """Yield the nodes in the order of three.js, each once; it names a scene before its nodes."""
    nodes = document.nodes
    rootless = [index for index, parent in enumerate(parents) if parent is None]
    visited = bytearray(len(nodes))
    for scene in document.scenes or [gltf.Roots(nodes=rootless)]:
        if scene.name:
            unique(scene.name)
        waiting = list(reversed(scene.nodes))
        while waiting:
            index = waiting.pop()
            if index >= len(nodes) or visited[index]:
                continue
            visited[index] = 1
            yield index
            waiting += reversed(nodes[index].children)


def _godot(document: gltf.Document) -> Names:
    used: set[str] = set()

    def unique(name: str) -> str:
        name = _GODOT_OUT.sub("_", name) or "Node"
        number, longer = 1, name
        while longer in used:
            number += 1
            longer = f"{name}{number}"
        used.add(longer)
        return longer

    names = (
        unique(node.name or ("Node" if node.mesh is None else "Mesh")) for node in document.nodes
    )
    return tuple(tuple(dict.fromkeys((name, _GODOT_HINT.sub("", name)))) for name in names)
