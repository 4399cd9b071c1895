"""Scans a glTF file from Python: `hapticvlm.scan`, and the result that a notebook shows as a table.

`hapticvlm scan` prints the same result.
"""

from __future__ import annotations

import html
import os
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from hapticvlm.scenes import scan as surface_scan
from hapticvlm.scenes.reading import read_scene
from hapticvlm.scenes.scan import Row, Summary, surfaces_of
from hapticvlm.scenes.scene import Scene, SceneError, SceneNode
from hapticvlm.scenes.texture_reader import TextureReader

SHOWN = 200  # surfaces in a notebook, the least sure
_HEAD = ("object", "surface", "material", "sure", "by", "felt as", "degC")


@dataclass(frozen=True, slots=True)
class ScannedScene:
    """The decision that the service would make on each surface of a scene, before any frame.

    - `path`: the file.
    - `rows`: one for each surface, in the file's order. `row.object_id` and `row.surface` are the
      object's id and the index of the surface in it. `row.decision` is the service's `decision`
      (docs/protocol.md): `material`, `confidence` (0..1), `source`, `felt`, `contact_c` (degC).
      `row.sureness` is `sure`, `probable` or `unknown`.
    - `summary`: the counts of surfaces by sureness, and what would make the others sure.
    - `notes`: a sentence for each part of the file that could not be read.
    """

    path: Path
    rows: tuple[Row, ...]
    summary: Summary
    notes: tuple[str, ...]

    def _repr_html_(self) -> str:
        rows = sorted(self.rows, key=lambda row: row.decision.confidence)
        head = "".join(f"<th>{name}</th>" for name in _HEAD)
        body = "".join(_line(row) for row in rows[:SHOWN])
        more = len(rows) - SHOWN
        counts = ", ".join(f"{count} {sureness}" for sureness, count in self.summary.counts.items())
        sentences = [
            f"{self.path.name}: {counts}",
            *([f"{more} surer surfaces are not shown"] if more > 0 else []),
            *self.summary.help,
            *self.notes,
        ]
        text = "<br>".join(map(html.escape, sentences))
        return f"<table><tr>{head}</tr>{body}</table><p>{text}</p>"


def scan(path: str | os.PathLike[str]) -> ScannedScene:
    """Decide on each surface of a glTF 2.0 scene as the service would before any frame.

    The names of objects, materials and textures decide, then the shader, and where these leave it
    open, the texture. `path` is a .glb or .gltf file; buffers and textures are only read below its
    folder. What a texture showed is kept in the cache folder, so that a second scan is quick.

    Raises `HapticVLMError` if the file cannot be read. A part that cannot be read is a note.

        [row.object_id for row in hapticvlm.scan("room.glb").rows if row.sureness != "sure"]
    """
    if not isinstance(path, str | os.PathLike):
        raise SceneError("path: give the path of a .glb or .gltf file")
    file = Path(path)
    scene = read_scene(file)
    return scanned(file, scene, surfaces_of(scene))


def scanned(path: Path, scene: Scene, surfaces: Iterable[tuple[SceneNode, int]]) -> ScannedScene:
    """Decide on these surfaces of a scene; `surfaces` may count them for a bar of progress."""
    look = TextureReader()
    rows = tuple(surface_scan.scan(surfaces, look=look))
    notes = (*scene.notes, *look.problems)
    return ScannedScene(path, rows, surface_scan.summarise(rows), notes)


def _line(row: Row) -> str:
    decision = row.decision
    contact = "" if decision.contact_c is None else f"{decision.contact_c:.1f}"
    cells = (
        row.object_id,
        row.said or row.texture or "",
        decision.material,
        f"{decision.confidence:.2f}",
        decision.source,
        decision.felt or "",
        contact,
    )
    return f"<tr>{''.join(f'<td>{html.escape(cell)}</td>' for cell in cells)}</tr>"
