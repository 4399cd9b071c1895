"""`hapticvlm scan` prints what the service would make of the surfaces of glTF scenes."""

from __future__ import annotations

import argparse
import csv
import json
import os
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from hapticvlm import documents
from hapticvlm.commands.parsing import add_json
from hapticvlm.commands.progress import track, working
from hapticvlm.errors import UsageError, printable

if TYPE_CHECKING:
    from hapticvlm.commands.parsing import Commands
    from hapticvlm.scenes.scan import Row
    from hapticvlm.scenes.scanned_scene import ScannedScene

DIGITS = 4  # of a confidence
WIDEST = (44, 28)  # characters of an object's and a surface's name, before they are cut
MAX_FILES = 1000  # of one folder
MAX_ENTRIES = 100_000  # of folders that are searched for scenes
CSV_HEAD = (
    "file,object_id,surface,surface_name,texture,material,confidence,sureness,source,runner_up,"
    "felt,contact_c"
)

_DESCRIPTION = """
Print what the service would make of each surface of glTF 2.0 scenes (.glb, .gltf, .vrm), before any
frame is recognised. Names of objects, their parents, materials and textures decide, and shaders.
Where these leave it open, the texture does. A folder stands for all scenes in it and its
sub-folders. `sure` is the confidence: from 0.80 on no picture is needed, below 0.50 the material is
`unknown`. `felt as` is the material that is rendered, also where none is sure enough to be named;
`-` is nothing, since any material would be a guess.
`degC` is the temperature of the skin that touches it, in air of 22 degC. The least sure surfaces
come last. Exit code 1: a scene could not be read; 2: no scene was found, or an option is wrong.
"""


@dataclass(frozen=True, slots=True)
class Scanned:
    """The scan of one file, or the error that prevented it."""

    path: Path
    result: ScannedScene | None = None
    error: str | None = None


def add(commands: Commands) -> None:
    """Declare the command and its options."""
    scan = commands.add_parser(
        "scan",
        help="print what the service would make of a glTF scene",
        description=_DESCRIPTION,
        examples=(
            "hapticvlm scan room.glb",
            "hapticvlm scan scenes/ --csv > surfaces.csv",
            "hapticvlm scan room.glb --messages > scene.jsonl",
        ),
    )
    scan.set_defaults(run=_scan)
    scan.add_argument(
        "paths",
        type=Path,
        nargs="+",
        metavar="PATH",
        help=".glb or .gltf files, or folders of them",
    )
    forms = scan.add_mutually_exclusive_group()
    add_json(forms)
    forms.add_argument("--csv", action="store_true", help="print a line of CSV for each surface")
    forms.add_argument(
        "--messages",
        action="store_true",
        help="print the `scene` messages that declare one scene to a service, as lines of JSON",
    )


def _scan(options: argparse.Namespace) -> int:
    files = [pair for path in options.paths for pair in find(path)]
    if not files:
        raise UsageError("no scene found; give .glb or .gltf files, or folders of them")
    if options.messages and len(files) > 1:
        raise UsageError(f"--messages takes one scene, and {len(files)} were found")
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):  # names may have any letters
            stream.reconfigure(encoding="utf-8", errors="backslashreplace")
    if options.messages:
        return _print_messages(*files[0])
    return _print_scans(files, as_json=options.json, as_csv=options.csv)


def _print_scans(files: Sequence[tuple[Path, Path]], *, as_json: bool, as_csv: bool) -> int:
    if as_csv:
        print(CSV_HEAD)
    failed = False
    for path, root in files:
        scanned = _scanned(path, root)
        failed |= scanned.error is not None
        if as_json:
            print(json.dumps(_fields(scanned), ensure_ascii=False), flush=True)
        else:
            _show(scanned, as_csv=as_csv)
    return 1 if failed else 0


def _show(scanned: Scanned, *, as_csv: bool) -> None:
    """Print a scan for people or spreadsheets; what could not be read is told on stderr."""
    if scanned.error is not None:
        _complain(scanned.error)
    if scanned.result is None:
        return
    for note in scanned.result.notes:
        _complain(f"{scanned.path}: {note}")
    if as_csv:
        lines = [_cells(scanned.path, row) for row in scanned.result.rows]
        csv.writer(sys.stdout, lineterminator="\n").writerows(lines)
    else:
        _print(scanned.result)


def find(path: Path) -> list[tuple[Path, Path]]:
    """Return the scenes that a path stands for, each with the folder that its files may be in.

    Raises UsageError.
    """
    from hapticvlm.scenes.files import ENDINGS

    if not path.is_dir():
        if not path.exists():
            raise UsageError(f"{path}: no such file or folder")
        return [(path, path.parent)]
    scenes: list[Path] = []
    entries = 0
    for folder, folders, names in os.walk(path):
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        entries += len(folders) + len(names)
        scenes += [Path(folder, name) for name in names if name.lower().endswith(ENDINGS)]
        if len(scenes) > MAX_FILES or entries > MAX_ENTRIES:
            raise UsageError(
                f"{path}: more than {MAX_FILES} scenes or {MAX_ENTRIES} files; give a folder in it"
            )
    return [(scene, path) for scene in sorted(scenes)]


def _scanned(path: Path, root: Path) -> Scanned:
    from hapticvlm.scenes.reading import read_scene
    from hapticvlm.scenes.scan import surfaces_of
    from hapticvlm.scenes.scanned_scene import scanned
    from hapticvlm.scenes.scene import SceneError

    try:
        with working(f"reading {path.name}"):
            scene = read_scene(path, root)
    except SceneError as error:
        return Scanned(path, error=str(error))
    surfaces = track(surfaces_of(scene), f"scanning {path.name}")
    return Scanned(path, scanned(path, scene, surfaces))


def _print_messages(path: Path, root: Path) -> int:
    from hapticvlm import materials, messages
    from hapticvlm.evidence.lexicon import read_lexicon
    from hapticvlm.scenes.declaration import messages_of
    from hapticvlm.scenes.reading import read_scene
    from hapticvlm.scenes.scene import SceneError

    try:
        with working(f"reading {path.name}"):
            scene = read_scene(path, root)
    except SceneError as error:
        _complain(str(error))
        return 1
    for note in scene.notes:
        _complain(f"{path}: {note}")
    for message in messages_of(scene, read_lexicon(materials.MATERIALS)):
        print(messages.encode(message, as_text=True))
    return 0


def _print(scanned: ScannedScene) -> None:
    """Print a table, the least sure surface last, and the summary below it."""
    rows = sorted(scanned.rows, key=lambda row: -row.decision.confidence)
    cells = [
        (_cut(row.object_id, WIDEST[0]), _cut(row.said or row.texture or "-", WIDEST[1]), row)
        for row in rows
    ]
    wide = max([len("object"), *(len(cell[0]) for cell in cells)])
    narrow = max([len("surface"), *(len(cell[1]) for cell in cells)])
    if cells:
        print(f"{'object':<{wide}}  {'surface':<{narrow}}  {_HEAD}")
    for name, surface, row in cells:
        print(f"{name:<{wide}}  {surface:<{narrow}}  {_columns(row)}".rstrip())
    summary = scanned.summary
    counts = ", ".join(f"{count} {sureness}" for sureness, count in summary.counts.items())
    surfaces = f"{summary.surfaces} surface{'' if summary.surfaces == 1 else 's'}"
    objects = f"{summary.objects} object{'' if summary.objects == 1 else 's'}"
    print(f"{scanned.path}: {surfaces} of {objects}: {counts}")
    for sentence in summary.help:
        print(f"  {sentence}")
    print(flush=True)


_HEAD = f"{'material':<10} {'sure':>4}  {'by':<8} {'felt as':<10} {'degC':>5}"


def _columns(row: Row) -> str:
    decision = row.decision
    contact = "-" if decision.contact_c is None else f"{decision.contact_c:.1f}"
    by = "-" if decision.source == "unknown" else decision.source
    return (
        f"{decision.material:<10} {decision.confidence:4.2f}  {by:<8} "
        f"{decision.felt or '-':<10} {contact:>5}"
    )


def _fields(scanned: Scanned) -> dict[str, object]:
    file = str(scanned.path)
    if scanned.result is None:
        return {"file": file, "error": scanned.error}
    summary = scanned.result.summary
    sizes = {"objects": summary.objects, "surfaces": summary.surfaces}
    return {
        "file": file,
        "surfaces": [_row_fields(row) for row in scanned.result.rows],
        "counts": sizes | {str(each): count for each, count in summary.counts.items()},
        "help": list(summary.help),
        "notes": list(scanned.result.notes),
    }


def _row_fields(row: Row) -> dict[str, object]:
    decision = row.decision
    contact = decision.contact_c
    return {
        "object_id": row.object_id,
        "surface": row.surface,
        "surface_name": row.said,
        "texture": row.texture,
        "material": decision.material,
        "confidence": round(decision.confidence, DIGITS),
        "sureness": row.sureness,
        "source": decision.source,
        "runner_up": decision.runner_up,
        "felt": decision.felt,
        "contact_c": None if contact is None else round(contact, 2),
    }


def _cells(path: Path, row: Row) -> list[object]:
    fields: dict[str, object] = {"file": str(path), **_row_fields(row)}
    return [documents.spreadsheet_cell(field) for field in fields.values()]


def _cut(name: str, width: int) -> str:
    """Return the end of a name, which tells most, behind dots where it was cut."""
    return name if len(name) <= width else f"...{name[3 - width :]}"


def _complain(text: str) -> None:
    print(f"hapticvlm scan: {printable(text)}", file=sys.stderr, flush=True)
