"""`hapticvlm bake`: writes how a scene feels to files, for players without a service."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from hapticvlm import documents
from hapticvlm.commands import touch_options
from hapticvlm.commands.progress import track, working
from hapticvlm.errors import UsageError, printable, usage_errors

if TYPE_CHECKING:
    from hapticvlm.commands.parsing import Commands
    from hapticvlm.materials import Material
    from hapticvlm.messages import Scene
    from hapticvlm.scenes.bake import Bake, Materials
    from hapticvlm.scenes.scene import SceneNode
    from hapticvlm.session.scene_model import SceneModel

FEEL = "feel.{voice}.json"
MATERIALS = "materials.json"
MOST_CHARS = 4000  # of a sentence that names things of a scene, whose names may hold anything
_DESCRIPTION = """
Write how a scene feels to a folder, for players that have no service: materials.json (what each
surface is), feel.true.json and feel.sound.json (how its materials vibrate and sound). SOURCE is a
glTF 2.0 scene (.glb, .gltf), a file of `scene` messages (a list, or a message a line), or a folder
that `hapticvlm serve --record FOLDER` wrote. Any other folder stands for the glTF scenes in it,
each baked to a folder of its own. Surfaces are decided as by `hapticvlm scan`, open ones by their
textures. Corrections by hand in materials.json stay (docs/bake.md). Exit code 1: a scene of a
folder could not be read.
"""


def add(commands: Commands) -> None:
    """Declare the command and its options."""
    bake = commands.add_parser(
        "bake",
        help="write how a scene feels to files",
        description=_DESCRIPTION,
        examples=("hapticvlm bake room.glb -o baked", "hapticvlm bake --materials -o baked"),
    )
    bake.set_defaults(run=_bake)
    bake.add_argument(
        "source",
        nargs="?",
        type=Path,
        metavar="SOURCE",
        help="a glTF scene, scene messages, a recording, or a folder of glTF scenes",
    )
    bake.add_argument(
        "-o", "--out", required=True, type=Path, metavar="FOLDER", help="folder to write to"
    )
    bake.add_argument(
        "--materials", action="store_true", help="all materials of the table, without a scene"
    )
    bake.add_argument(
        "--unknown",
        metavar="MATERIAL",
        help="what surfaces are felt as of which nothing is known, such as leather",
    )
    touch_options.add_gallery(bake)


def _bake(options: argparse.Namespace) -> int:
    if (options.source is None) != options.materials:
        raise UsageError("give either SOURCE or --materials")
    with usage_errors():
        table = touch_options.table(options.gallery)
    if options.materials:
        _write_feel(table, options.out)
        return 0
    _require_known(options.unknown, table)
    scenes = _scenes_in(options.source)
    if scenes is None:
        _bake_one(*_model(options.source, table), table, options.out, options)
        return 0
    failed = False
    for scene in scenes:
        out = options.out / scene.relative_to(options.source)
        try:
            _bake_one(*_model_of_gltf(scene, table, options.source), table, out, options)
        except UsageError as error:
            failed = True
            print(f"hapticvlm bake: {printable(str(error))}", file=sys.stderr)
    return 1 if failed else 0


def _require_known(unknown: str | None, table: Mapping[str, Material]) -> None:
    from hapticvlm.materials import no_material

    if unknown is not None and unknown not in table:
        raise UsageError(f"--unknown: {no_material(unknown, table)}")


def _scenes_in(source: Path) -> list[Path] | None:
    """Return the glTF scenes of a folder; None for a file or a recording. Raises UsageError."""
    from hapticvlm.commands.scan import find
    from hapticvlm.recordings.recorder import SESSION_LOG

    if not source.is_dir() or (source / SESSION_LOG).exists():
        return None
    return [scene for scene, _ in find(source)] or None


def _bake_one(
    model: SceneModel,
    nodes: Iterable[SceneNode],
    table: Mapping[str, Material],
    out: Path,
    options: argparse.Namespace,
) -> None:
    """Write the bake of one scene to a folder. Raises UsageError, OSError."""
    from hapticvlm.scenes import bake

    before = _before(out / MATERIALS)
    baked = bake.bake(model, table, before, nodes=nodes, unknown=options.unknown)
    out.mkdir(parents=True, exist_ok=True)
    documents.replace_file(out / MATERIALS, bake.encode(baked.materials))
    _report(baked, out)
    _write_feel(baked.felt, out)


def _write_feel(materials: Mapping[str, Material], out: Path) -> None:
    """Write the feel of these materials in each voice."""
    from hapticvlm.rendering.vibration import feel_clips
    from hapticvlm.rendering.vibration.vibration import VOICES

    out.mkdir(parents=True, exist_ok=True)
    files = [out / FEEL.format(voice=voice) for voice in VOICES]
    for voice, file in zip(VOICES, files, strict=True):
        documents.replace_file(file, feel_clips.encode(feel_clips.feel(materials, voice)))
    print(f"{', '.join(map(str, files))}: {len(materials)} materials")


def _report(baked: Bake, folder: Path) -> None:
    objects = baked.materials.objects.values()
    corrected = ("hand", "pattern")
    by_hand = sum(surface.by in corrected for each in objects for surface in each.surfaces)
    print(f"{folder / MATERIALS}: {len(objects)} objects, {by_hand} corrected by hand; not baked:")
    for sentence in baked.materials.not_baked:
        print(f"  {printable(sentence, MOST_CHARS)}")
    if baked.lost:
        gone = printable(", ".join(baked.lost), MOST_CHARS)
        print(f"  corrections of surfaces that the scene no longer has: {gone}")


def _before(path: Path) -> Materials | None:
    from hapticvlm.scenes.bake import decode

    return decode(documents.read_bytes(path)) if path.exists() else None


def _model(source: Path, table: Mapping[str, Material]) -> tuple[SceneModel, tuple[SceneNode, ...]]:
    """Return the model of the scene in this file or recording, and its nodes if it is glTF.

    Raises UsageError.
    """
    from hapticvlm.messages import MessageError
    from hapticvlm.recordings.replay import replay
    from hapticvlm.recordings.session_log import newest_session
    from hapticvlm.scenes.bake import model_of
    from hapticvlm.scenes.files import ENDINGS

    if source.is_dir():
        return replay(newest_session(source), table).model, ()
    if source.name.lower().endswith(ENDINGS):
        return _model_of_gltf(source, table, source.parent)
    try:
        return model_of(_scenes(source), table), ()
    except (MessageError, ValueError) as error:
        raise UsageError(f"{source}: no glTF scene, and no `scene` messages: {error}") from None


def _model_of_gltf(
    source: Path, table: Mapping[str, Material], root: Path
) -> tuple[SceneModel, tuple[SceneNode, ...]]:
    """Return the model of a glTF scene, its textures read, and its nodes; files are below `root`.

    Raises UsageError.
    """
    from hapticvlm.evidence.lexicon import read_lexicon
    from hapticvlm.scenes import bake
    from hapticvlm.scenes.declaration import messages_of
    from hapticvlm.scenes.reading import read_scene
    from hapticvlm.scenes.scan import surfaces_of
    from hapticvlm.scenes.scene import SceneError
    from hapticvlm.scenes.texture_reader import TextureReader

    try:
        with working(f"reading {source.name}"):
            scene = read_scene(source, root, table)
    except SceneError as error:
        raise UsageError(str(error)) from None
    model = bake.model_of(messages_of(scene, read_lexicon(table)), table)
    look = TextureReader()
    bake.read_textures(model, track(surfaces_of(scene), f"baking {source.name}"), look)
    for note in (*scene.notes, *look.problems):
        print(f"hapticvlm bake: {source}: {printable(note)}", file=sys.stderr)
    return model, scene.objects


def _scenes(source: Path) -> Iterator[Scene]:
    """Yield the `scene` messages of a file. Raises UsageError, MessageError, ValueError."""
    import json

    from hapticvlm.messages import Scene, decode

    content = documents.read_text(source)
    try:
        document = documents.parse_json(content)
    except ValueError:
        lines = [line for line in content.splitlines() if line.strip()]
    else:
        several = document if isinstance(document, list) else [document]
        lines = [json.dumps(one) for one in several]
    if not all(line.startswith("{") for line in lines):
        raise UsageError(f"{source}: neither a glTF scene nor `scene` messages; give one of them")
    messages = [decode(line) for line in lines]
    scenes = [message for message in messages if isinstance(message, Scene)]
    if not scenes:
        raise UsageError(f"{source}: has no `scene` message; write one, as docs/protocol.md has it")
    yield from scenes
