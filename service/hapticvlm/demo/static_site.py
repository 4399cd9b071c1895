"""Writes a labelled photograph, all materials and the WebXR room as files that any web host serves.

The files lie where the service serves them: its pages at the top, the scene below `scene/`. Their
addresses are relative, so both find each other below any address. The room's page states that it
has no service, and both say in the page what did not load. A host sends no policy for them, so each
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
from collections.abc import Iterator, Mapping
from pathlib import Path, PurePosixPath

from hapticvlm import documents
from hapticvlm.errors import UsageError
from hapticvlm.server.web.scene_files import inline_scripts

LIST = "hapticvlm-static.json"
PAGES = (
    "dom.js",
    "feel.js",
    "hear.js",
    "icon.svg",
    "link.js",
    "palette.css",
    "sound.buffers.js",
    "sound.js",
    "sound.stream.js",
    "sound.voice.js",
    "sound.worklet.js",
    "try.table.jpg",
    "try.things.js",
)
_HERE = Path(__file__).parent
_ROOM = "webxr/index.html"
_GALLERY = "index.html"
_CHARSET = '<meta charset="utf-8">'  # which the policy follows, before anything that it governs
_POLICY = (
    "default-src 'self'; img-src 'self' data: blob:; connect-src 'self' data: blob:; "
    "base-uri 'none'; form-action 'none'; script-src 'self'"
)
_EDITS = (  # of the room's page
    ('<html lang="en">', '<html lang="en" data-service="none">'),
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

    `examples` holds the scene with the libraries that draw it. Raises UsageError where the folder
    has a file that no earlier run wrote, and OSError.
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
        path.write_bytes(content)
    _list(folder, {name: _digest(content) for name, content in files.items()})
    return sum(len(content) for content in files.values())


def _files(examples: Path) -> Iterator[tuple[str, bytes]]:
    """Yield the address of each file below the site, and its content."""
    for file in sorted((_HERE / "static").iterdir()):
        content = file.read_bytes()
        yield file.name, _governed(content.decode()) if file.name == _GALLERY else content
    for name in PAGES:
        yield name, (_HERE.parent / "pages" / name).read_bytes()
    for pattern in json.loads((_HERE / "scene_files.json").read_text(encoding="utf-8")):
        for file in sorted(examples.glob(pattern)):
            name = file.relative_to(examples).as_posix()
            content = file.read_bytes()
            if name == _ROOM:
                page = content.decode()
                for served, alone in _EDITS:
                    assert served in page, served
                    page = page.replace(served, alone)
                content = _governed(page)
            elif name.endswith(".mjs"):
                name, content = name.removesuffix(".mjs") + ".js", content.replace(b".mjs", b".js")
            yield f"scene/{name.replace('/node_modules/', '/lib/')}", content


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
