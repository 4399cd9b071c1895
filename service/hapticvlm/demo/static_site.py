"""Writes the page `/try` and the WebXR room as files that any web host serves.

The files lie where the service serves them: its pages at the top, the scene below `scene/`. Their
addresses are relative, so both find each other below any address. `/try` is the service's own page:
an import map puts `static/try.link.js`, which answers from a bake, in the place of its link to the
service. Both pages state that they have no service, and say what did not load. Where three.js is
not installed, the room is left out. A host sends no policy for them, so each
states its own: a browser runs and loads what is in the folder, and nothing else. Libraries lie in
`lib`, because several hosts leave `node_modules` out, and end in `.js`, because some serve `.mjs`
as no script.

A folder is written again only if every file to be replaced is one that an earlier run wrote, as it
wrote it. LIST names them with their digests. While a run writes, LIST has no digests: what it names
may then be incomplete, and the next run replaces it.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path, PurePosixPath

import msgspec

from hapticvlm import __version__, documents
from hapticvlm.errors import UsageError
from hapticvlm.materials import MATERIALS
from hapticvlm.messages import Decision, Scene, SceneObject, Touch
from hapticvlm.server.web.scene_files import inline_scripts
from hapticvlm.session.actions import Reply
from hapticvlm.session.session import SceneSession
from hapticvlm.session.settings import SessionSettings

LIST = "hapticvlm-static.json"
_HERE = Path(__file__).parent
_PAGES = _HERE.parent / "pages"
_ROOM = "webxr/index.html"
_PLAYER = ("webxr/baked.js", "webxr/client/")  # what the page needs of the scene's files
_NAMED = re.compile(r"""["'](?:\./)?([\w.]+\.(?:js|css|svg))["']""")  # a page's file in another
# What the service answers for the page's panel about phones, which asks it by this name.
_STATUS = b'{"reach": {"page": null, "why": "Open the address of this page on your phone."}}'
_CHARSET = '<meta charset="utf-8">'  # which the policy follows, before anything that it governs
_POLICY = (
    "default-src 'self'; img-src 'self' data: blob:; connect-src 'self' data: blob:; "
    "base-uri 'none'; form-action 'none'; script-src 'self'"
)
_ALONE = ('<html lang="en">', '<html lang="en" data-service="none">')
_TRY_EDITS = (
    _ALONE,
    ("Connecting to the service.", "Loading"),
    (
        '<script type="module"',
        '<script src="loading.js"></script>\n<script type="importmap">\n  '
        '{"imports": {"./link.js": "./try.link.js", "hapticvlm": "./scene/webxr/client/player.js"}}'
        '\n</script>\n<script type="module"',
    ),
)
_DASHBOARD = '<a href="/">Dashboard</a>'
_TO_ROOM = '<a href="scene/webxr/">A room to touch</a>'
_ROOM_EDITS = (
    _ALONE,
    (
        '<script type="importmap">',
        '<script src="../../loading.js"></script>\n<script type="importmap">',
    ),
    ("Loading. If this stays: <code>npm ci --prefix examples/webxr</code>", "Loading"),
    ("./node_modules/", "./lib/"),
    (".mjs", ".js"),
)


def write(examples: Path, folder: Path) -> int:
    """Write the site to a folder; return its size in bytes.

    `examples` holds the scene, with or without the libraries that draw it. Raises UsageError where
    the folder has a file that no earlier run wrote, and OSError.
    """
    files = dict(_files(examples))
    before = _written(folder)
    _refuse_foreign(folder, files, before)
    folder.mkdir(parents=True, exist_ok=True)
    _list(folder, dict.fromkeys({**before, **files}))
    for name in before:
        _place(folder, name).unlink(missing_ok=True)
    for name, content in files.items():
        path = _place(folder, name)
        path.parent.mkdir(parents=True, exist_ok=True)
        with documents.naming(path):
            path.write_bytes(content)
    _list(folder, {name: _digest(content) for name, content in files.items()})
    return sum(len(content) for content in files.values())


def has_room(examples: Path) -> bool:
    """Whether the libraries that draw the room are there."""
    return (examples / "webxr" / "node_modules" / "three").is_dir()


def _files(examples: Path) -> Iterator[tuple[str, bytes]]:
    """Yield the address of each file below the site, and its content."""
    link = _TO_ROOM if has_room(examples) else ""
    page = (_PAGES / "try.html").read_text(encoding="utf-8")
    yield "index.html", _governed(_edited(page, (*_TRY_EDITS, (_DASHBOARD, link))))
    yield "try.decisions.json", _decisions()
    yield "status", _STATUS
    for file in sorted((_HERE / "static").iterdir()):
        yield file.name, file.read_bytes()
    for name in sorted({*_named_by("try.html"), *(file.name for file in _PAGES.glob("try.*.jpg"))}):
        yield name, (_PAGES / name).read_bytes()
    for pattern in json.loads((_HERE / "scene_files.json").read_text(encoding="utf-8")):
        for file in sorted(examples.glob(pattern)):
            name = file.relative_to(examples).as_posix()
            if has_room(examples) or name.startswith(_PLAYER):
                yield _scene_file(name, file.read_bytes())


def _scene_file(name: str, content: bytes) -> tuple[str, bytes]:
    """Return the address and the content of a file of the scene."""
    if name == _ROOM:
        content = _governed(_edited(content.decode(), _ROOM_EDITS))
    elif name.endswith(".mjs"):
        name, content = name.removesuffix(".mjs") + ".js", content.replace(b".mjs", b".js")
    return f"scene/{name.replace('/node_modules/', '/lib/')}", content


def _edited(page: str, edits: Iterable[tuple[str, str]]) -> str:
    """Return a page with each of its replacements; all must be in it."""
    for served, alone in edits:
        assert served in page, served
        page = page.replace(served, alone)
    return page


def _named_by(name: str) -> set[str]:
    """Return the files of the service's pages that a page loads, and those that they load."""
    names: set[str] = set()
    new = {name}
    while new:
        texts = [(_PAGES / one).read_text(encoding="utf-8") for one in new]
        named = {found for text in texts for found in _NAMED.findall(text)}
        new = {one for one in named - names if (_PAGES / one).is_file()}
        names |= new
    return names


def _decisions() -> bytes:
    """Return what the service decides of an object of each material, and of one of none."""
    session = SceneSession(SessionSettings(owner=True))
    stated = [SceneObject(object_id=name, material=name) for name in MATERIALS]
    objects = [*stated, SceneObject(object_id="unknown")]
    session.receive(Scene(id=1, objects=objects, replace=True), 0.0)
    decisions = {}
    for name in (*MATERIALS, "unknown"):
        touch = Touch(
            id=2,
            phase="contact",
            hand="right",
            object_id=name,
            speed_mps=0.3,
            force_n=1.0,
            captured_at=0.0,
        )
        replies = [one.message for one in session.receive(touch, 0.0) if isinstance(one, Reply)]
        [decisions[name]] = [message for message in replies if isinstance(message, Decision)]
    service = {"name": "hapticvlm bake", "version": __version__}
    return msgspec.json.encode({"service": service, "decisions": decisions})


def _governed(page: str) -> bytes:
    """Return a page with its policy, by which its inline scripts are known by their hashes."""
    assert _CHARSET in page
    policy = f'content="{_POLICY}{inline_scripts(page)}"'
    tag = f'{_CHARSET}\n<meta http-equiv="Content-Security-Policy" {policy}>'
    return page.replace(_CHARSET, tag).encode()


def _written(folder: Path) -> dict[str, str | None]:
    """Return the files of the run before and their digests; None: that run did not end.

    Raises UsageError.
    """
    path = folder / LIST
    if not path.exists():
        return {}
    try:
        names = documents.read_json(path, dict[str, str | None])
        for name in names:
            _place(folder, name)
    except ValueError as error:
        raise UsageError(f"{path}: {error}; remove it, or give another folder") from None
    return names


def _refuse_foreign(
    folder: Path, files: Mapping[str, bytes], before: Mapping[str, str | None]
) -> None:
    """Raise UsageError for a file that a run would replace or remove although none wrote it."""
    if folder.exists() and not folder.is_dir():
        raise UsageError(f"{folder}: is a file; give a folder")
    if not before and folder.exists() and any(folder.iterdir()):
        raise UsageError(
            f"{folder}: has files and no {LIST}, so this command did not write it; "
            "give a new or an empty folder"
        )
    for name in {**before, **files}:
        path = _place(folder, name)
        if path.exists() and not (name in before and _is_as_written(path, before[name])):
            raise UsageError(
                f"{path}: was changed or made by someone else; move it, or give another folder"
            )


def _is_as_written(path: Path, digest: str | None) -> bool:
    """Whether a file is the one of this digest; any file where the digest is not known."""
    return path.is_file() and digest in (None, _digest(path.read_bytes()))


def _place(folder: Path, name: str) -> Path:
    """Return the path of a file of the site. Raises ValueError for one that is not below it."""
    parts = PurePosixPath(name).parts
    path = folder.joinpath(*parts)
    if not parts or not path.resolve().is_relative_to(folder.resolve()):
        raise ValueError(f"{name}: is not below the folder")
    return path


def _list(folder: Path, digests: Mapping[str, str | None]) -> None:
    """Write LIST whole or not at all."""
    text = json.dumps(dict(sorted(digests.items())), indent=1) + "\n"
    documents.replace_file(folder / LIST, text.encode())


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()
