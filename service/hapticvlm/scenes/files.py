"""Reads the bytes of a glTF scene: .gltf and .glb files, buffers, pictures, and data in the text.

A scene comes from a stranger. A URI in it may only name a file below the scene's root folder, never
an address or a file elsewhere. All sizes are bounded, and only the requested range of a file is
read, so that a scene of gigabytes costs what its names cost.
"""

from __future__ import annotations

import base64
import binascii
import re
import struct
import unicodedata
from pathlib import Path
from urllib.parse import unquote

from hapticvlm import documents
from hapticvlm.errors import printable
from hapticvlm.scenes import gltf
from hapticvlm.scenes.scene import SceneError

MIB = documents.MIB
MAX_TEXT_BYTES = 128 * MIB  # of a document; pictures in the text included
MAX_PICTURE_BYTES = 32 * MIB
GEOMETRY_BYTES = 256 * MIB  # that are read of one scene to compare its surfaces
ENDINGS = (".glb", ".gltf", ".vrm")

_TOO_LARGE = f"a picture of more than {MAX_PICTURE_BYTES // MIB} MiB, the limit"
_TOO_SHORT = "ends too early; copy or export it again"
_MAGIC = b"glTF"
_HEADER = struct.Struct("<4sII")  # magic, version, length of all
_CHUNK = struct.Struct("<I4s")  # length, type
_SCHEME = re.compile(r"[A-Za-z][A-Za-z0-9+.-]*:")
_KTX2 = b"\xabKTX 20\xbb"
_LFS = b"version https://git-lfs"


class SceneFiles:
    """The bytes that belong to one scene file.

    URIs are relative to the file's folder and must stay below `root`.
    """

    def __init__(self, path: Path, root: Path) -> None:
        self.path = path
        self._root = root.resolve()
        self._geometry_left = GEOMETRY_BYTES
        self._buffers: list[gltf.Buffer] = []
        self._binary: tuple[int, int] | None = None  # offset and length of a .glb's second part
        self._decoded: dict[int, bytes] = {}  # buffers that are in the text

    def document(self) -> gltf.Document:
        """Read and parse the document. Raises SceneError."""
        document = gltf.parse(self._text())
        self._buffers = document.buffers
        return document

    def _text(self) -> bytes:
        start = _read(self.path, 0, _HEADER.size, whole=False)
        if start[:4] == _MAGIC:
            return self._text_of_binary(start)
        if start and _LFS.startswith(start):
            raise SceneError("a Git LFS pointer and not the file itself; run `git lfs pull`")
        try:
            return documents.read_bytes(self.path, MAX_TEXT_BYTES)
        except (OSError, ValueError) as error:
            raise SceneError(documents.reason(error)) from None

    def _text_of_binary(self, start: bytes) -> bytes:
        """Return the JSON of a .glb and note where its second part is."""
        if len(start) < _HEADER.size:
            raise SceneError("ends within its header; copy the file again")
        _, version, _ = _HEADER.unpack(start)
        if version != 2:
            raise SceneError(f"a .glb of version {version}, and only 2 is read; export it again")
        at = _HEADER.size
        length, kind = _CHUNK.unpack(_read(self.path, at, _CHUNK.size))
        at += _CHUNK.size
        if kind != b"JSON":
            raise SceneError("does not begin with JSON, as a .glb must; export it again")
        if length > MAX_TEXT_BYTES:
            size = f"{MAX_TEXT_BYTES // MIB} MiB"
            raise SceneError(f"its JSON is larger than {size}, the limit; split the scene")
        content = _read(self.path, at, length)
        at += length
        second = _read(self.path, at, _CHUNK.size, whole=False)
        if len(second) == _CHUNK.size:
            length, _ = _CHUNK.unpack(second)
            _require(self.path, at + _CHUNK.size + length)
            self._binary = (at + _CHUNK.size, length)
        return content

    def geometry(self, view: gltf.BufferView, at: int, size: int) -> bytes:
        """Read a range of a buffer view. Raises SceneError, also when the budget is used up."""
        if size > self._geometry_left:
            mib = GEOMETRY_BYTES // MIB
            raise SceneError(f"more than {mib} MiB of geometry, the limit")
        self._geometry_left -= size
        return self.view(view, at, size)

    def view(self, view: gltf.BufferView, at: int, size: int) -> bytes:
        """Read a range of a buffer view. Raises SceneError."""
        if view.extensions.is_compressed:
            raise SceneError("compressed with meshopt, which is not read")
        if at + size > view.byte_length:
            raise SceneError("an accessor is longer than its buffer view")
        if view.buffer >= len(self._buffers):
            raise SceneError(f"a buffer view names buffer {view.buffer}, which does not exist")
        uri = self._buffers[view.buffer].uri
        at += view.byte_offset
        if uri is None:
            return self._from_binary(view.buffer, at, size)
        if uri.startswith("data:"):
            return self._from_text(view.buffer, uri, at, size)
        path = self.resolve(uri)
        try:
            return _read(path, at, size)
        except SceneError as error:
            raise SceneError(f"{printable(uri, 80)}: {error}") from None

    def _from_binary(self, buffer: int, at: int, size: int) -> bytes:
        if self._binary is None or buffer != 0:
            raise SceneError(f"buffer {buffer} has no data")
        offset, length = self._binary
        if at + size > length:
            raise SceneError("a buffer view is longer than the .glb")
        return _read(self.path, offset + at, size)

    def _from_text(self, buffer: int, uri: str, at: int, size: int) -> bytes:
        data = self._decoded.get(buffer)
        if data is None:
            data = self._decoded[buffer] = decode_data(uri)
        if at + size > len(data):
            raise SceneError(f"a buffer view is longer than buffer {buffer}")
        return data[at : at + size]

    def picture(self, uri: str) -> bytes:
        """Read a picture that a URI names or holds. Raises SceneError."""
        if uri.startswith("data:"):
            return readable_picture(decode_data(uri))
        path = self.resolve(uri)
        try:
            return readable_picture(documents.read_bytes(path, MAX_PICTURE_BYTES))
        except (OSError, ValueError) as error:
            reason = documents.reason(error)
            raise SceneError(f"{printable(uri, 80)}: {reason}") from None

    def picture_in(self, view: gltf.BufferView) -> bytes:
        """Read a picture that is a whole buffer view. Raises SceneError."""
        if view.byte_length > MAX_PICTURE_BYTES:
            raise SceneError(_TOO_LARGE)
        return readable_picture(self.view(view, 0, view.byte_length))

    def resolve(self, uri: str) -> Path:
        """Return the file that a URI names. Raises SceneError if it may not be read."""
        name = printable(uri, 80)
        if _SCHEME.match(uri):
            raise SceneError(f"{name}: an address or a drive; only files beside the scene are read")
        try:
            path = (self.path.parent / unquote(uri).replace("\\", "/")).resolve()
        except (OSError, ValueError, RuntimeError):  # NUL, a name that is too long, a circle
            raise SceneError(f"{name}: not the name of a file") from None
        path = _in_any_form(path)
        if not path.is_relative_to(self._root):
            raise SceneError(f"{name}: outside the scene's folder; scan the folder that has both")
        return path


def _in_any_form(path: Path) -> Path:
    """Return the file of this name, in whichever form of Unicode a system or program wrote it."""
    forms = (path, *(Path(unicodedata.normalize(form, str(path))) for form in ("NFC", "NFD")))
    return next((each for each in forms if each.exists()), path)


def readable_picture(data: bytes) -> bytes:
    """Return the picture if its format can be read. Raises SceneError."""
    if data.startswith(_LFS):
        raise SceneError("a Git LFS pointer and not the picture; run `git lfs pull`")
    if data.startswith(_KTX2):
        raise SceneError("a KTX2 picture, which is not read; its name counts")
    if len(data) > MAX_PICTURE_BYTES:
        raise SceneError(_TOO_LARGE)
    return data


def decode_data(uri: str) -> bytes:
    """Return the bytes of a data: URI. Raises SceneError."""
    head, comma, content = uri.partition(",")
    if not comma or not head.endswith(";base64"):
        raise SceneError("data in the text is not base64; export it again")
    try:
        return base64.b64decode(content, validate=True)
    except (binascii.Error, ValueError):
        raise SceneError("data in the text is broken base64; export it again") from None


def _read(path: Path, at: int, size: int, *, whole: bool = True) -> bytes:
    """Read a range of a file. Raises SceneError; if `whole`, also for a file that ends before."""
    try:
        with documents.open_file(path) as file:
            file.seek(at)
            data = file.read(size)
    except (OSError, ValueError, OverflowError) as error:
        raise SceneError(documents.reason(error)) from None
    if whole and len(data) < size:
        raise SceneError(_TOO_SHORT)
    return data


def _require(path: Path, size: int) -> None:
    if path.stat().st_size < size:
        raise SceneError(_TOO_SHORT)
