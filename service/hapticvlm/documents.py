"""Reads the files of users and strangers within limits, and writes files whole or not at all.

Without limits of size, time and nesting a named pipe would hang the reader, a device would never
end, a file of gigabytes would fill the memory, a slow disk would block the caller, and deep nesting
would overflow the parser's stack. Here each of them is an error that can be shown. Every file that
a user or a stranger names is opened by this module, which knows no field of any file.
"""

from __future__ import annotations

import codecs
import errno
import json
import os
import re
import stat
import time
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from io import BufferedReader
from pathlib import Path
from typing import IO, Any, TypeVar

MIB = 1024 * 1024
MAX_BYTES = 16 * MIB
READ_TIMEOUT_S = 10.0
PIECE_BYTES = 4 * MIB
MAX_KEY_PARTS = 16  # of a dotted TOML key; a key of thousands of parts unfolds to gigabytes
_ADDRESS = re.compile(r" <[^<>]* object at 0x[0-9a-f]+>")
_TOO_DEEP = "nested too deep"
_UTF_8 = "utf-8-sig"  # editors on Windows write a byte order mark
# How files begin that are not text, however they are saved.
_KINDS = {
    b"\xff\xd8\xff": "a JPEG picture",
    b"\x89PNG": "a PNG picture",
    b"PK\x03\x04": "a ZIP archive or a workbook",
    b"glTF": "a .glb scene",
}
_FORMULA_STARTS = tuple("=+-@\t\r\n\uff1d\uff0b\uff0d\uff20")  # the last four are full-width
_READ_AS_MISSING = frozenset(
    ("NA", "N/A", "n/a", "NaN", "nan", "NULL", "null", "None", "<NA>", "#NA", "#N/A", "#N/A N/A")
)

T = TypeVar("T")


def open_file(path: Path) -> BufferedReader:
    """Open a regular file for reading, never waiting for a writer. Raises OSError."""
    if path.is_dir():  # Windows would report a lack of permission instead
        raise OSError(errno.EISDIR, "a folder, and not a file", str(path))
    flags = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
    descriptor = os.open(path, flags)
    try:
        # The open file is checked and not its name, which could be given to another file between a
        # check and the opening.
        if not stat.S_ISREG(os.fstat(descriptor).st_mode):
            raise OSError(errno.EINVAL, "not a regular file", str(path))
        return os.fdopen(descriptor, "rb")
    except BaseException:
        os.close(descriptor)
        raise


def read_bytes(path: Path, max_bytes: int = MAX_BYTES, timeout_s: float = READ_TIMEOUT_S) -> bytes:
    """Read a regular file of at most `max_bytes` within `timeout_s`. Raises OSError, ValueError."""
    begun = time.monotonic()
    data = bytearray()
    with open_file(path) as file:
        while piece := file.read(min(PIECE_BYTES, max_bytes + 1 - len(data))):
            data += piece
            if len(data) > max_bytes:
                raise ValueError(f"larger than {_size(max_bytes)}, the limit; shorten it")
            if time.monotonic() - begun > timeout_s:
                reason = f"only {_size(len(data))} were read within {timeout_s:g} s"
                raise OSError(errno.ETIMEDOUT, f"{reason}; copy it to a local disk", str(path))
    return bytes(data)


def replace_file(path: Path, data: bytes | str, mode: int = 0o666) -> None:
    """Write a file whole or not at all, in place of the file or link of its name.

    After a power failure the old file or the new one is there. The temporary name is random, so
    nobody can put a link there, and begins with a dot, so who lists the folder ignores it. A new
    file has the permissions `mode` less the umask; an old one keeps its own. Raises OSError, which
    names `path`, also for a file that is read-only, and for a device or a pipe, whose name would be
    given to a file.
    """
    part = path.with_name(f".{path.name}.{os.urandom(4).hex()}.part")
    try:
        kept = kept_mode(path)
        with open(part, "xb", opener=lambda name, flags: os.open(name, flags, mode)) as file:
            if kept is not None:
                part.chmod(kept)
            file.write(data.encode() if isinstance(data, str) else data)
            file.flush()
            os.fsync(file.fileno())
        part.replace(path)
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from None
    finally:
        with suppress(OSError):
            part.unlink(missing_ok=True)
    sync_folder(path.parent)


def kept_mode(path: Path) -> int | None:
    """Return the permissions of the file to write; None for a link, and where there is none.

    Raises OSError for a file that is read-only, and for what is no file.
    """
    try:
        mode = path.stat().st_mode
    except FileNotFoundError:
        return None
    if not stat.S_ISREG(mode):
        if stat.S_ISDIR(mode):
            raise IsADirectoryError(errno.EISDIR, "a folder, and not a file")
        raise OSError(errno.EINVAL, "not a regular file")
    if path.is_symlink():
        return None
    if not os.access(path, os.W_OK):
        raise PermissionError(errno.EACCES, "read-only")
    return mode & 0o777


def locks(file: IO[Any]) -> bool:
    """Lock an open file until it is closed or the process ends; False: another program has it."""
    try:
        import fcntl

        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except (ImportError, OSError):  # Windows, and some file systems of a network, lock nothing
        pass
    return True


def sync_folder(folder: Path) -> None:
    """Bring the names of a folder to the disk, where the system does that (Windows does not)."""
    with suppress(OSError):
        number = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(number)
        finally:
            os.close(number)


def read_text(path: Path, max_bytes: int = MAX_BYTES) -> str:
    """Read a regular UTF-8 file, with or without a byte order mark. Raises OSError, ValueError."""
    try:
        return read_bytes(path, max_bytes).decode(_UTF_8)
    except UnicodeDecodeError as error:
        raise ValueError(reason(error)) from None


def read_toml(path: Path, kind: type[T], max_bytes: int = MAX_BYTES) -> T:
    """Read a TOML file as `kind`. Raises OSError, and ValueError that names the field."""
    content = read_bytes(path, max_bytes)
    try:
        document = parse_toml(content.decode(_UTF_8))
    except tomllib.TOMLDecodeError as error:
        raise ValueError(f"not TOML: {error}; strings need quotes") from None
    except UnicodeDecodeError as error:
        raise ValueError(f"not TOML: {reason(error)}") from None
    return _converted(document, kind)


def read_json(path: Path, kind: type[T], max_bytes: int = MAX_BYTES) -> T:
    """Read a JSON file as `kind`. Raises OSError, and ValueError that names the field."""
    content = read_bytes(path, max_bytes)
    try:
        document = parse_json(content)
    except ValueError as error:
        raise ValueError(f"not JSON: {reason(error)}") from None
    return _converted(document, kind)


def _converted(document: object, kind: type[T]) -> T:
    import msgspec  # a command that reads no file starts without it

    return msgspec.convert(document, kind)  # its ValidationError is a ValueError


def reason(error: Exception) -> str:
    """Return why a file could not be read or understood, in plain words and without its name.

    An exception of Python's own has a message for programmers, which is not shown.
    """
    match error:
        case OSError():
            return error.strerror or _ADDRESS.sub("", str(error))  # Pillow names its buffer
        case UnicodeDecodeError():
            return _why_no_text(error)
        case KeyError():
            return f"`{error.args[0]}` is missing"
        case RecursionError():
            return _TOO_DEEP
        case MemoryError():
            return "larger than this machine's memory"
        case ArithmeticError():
            return "a number is too large"
        case AttributeError() | LookupError() | TypeError():
            return "a value is of the wrong kind"
        case _:
            return str(error) or "incomplete"  # of this program, or of a library that reads files


def _why_no_text(error: UnicodeDecodeError) -> str:
    """Return what a file is instead of text, or which byte keeps it from being UTF-8."""
    data = error.object
    kind = next((kind for start, kind in _KINDS.items() if data.startswith(start)), None)
    is_utf16 = data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    if kind is not None or (b"\0" in data and not is_utf16):
        return f"{kind or 'a binary file'}, and not text"
    return f"byte {error.start + 1} is not UTF-8 text; save it as UTF-8"


@contextmanager
def naming(path: Path) -> Iterator[None]:
    """Add this name to an OSError that has none: that of a write, on a disk that is full."""
    try:
        yield
    except OSError as error:
        if error.filename is not None or error.errno is None:
            raise
        raise OSError(error.errno, error.strerror, str(path)) from None


def parse_toml(content: str) -> dict[str, Any]:
    """Parse TOML. Raises TOMLDecodeError, also for content that is nested too deep."""
    for number, line in enumerate(content.splitlines(), 1):
        key = line if line.lstrip().startswith("[") else line.partition("=")[0]
        if len(key) > MAX_KEY_PARTS and key.count(".") >= MAX_KEY_PARTS and not _is_list(key):
            raise tomllib.TOMLDecodeError(
                f"line {number}: a key has more than {MAX_KEY_PARTS} parts; use tables"
            )
    try:
        return tomllib.loads(content)
    except RecursionError:
        raise tomllib.TOMLDecodeError(_TOO_DEEP) from None
    except tomllib.TOMLDecodeError:
        raise
    except ValueError as error:  # an integer of thousands of digits
        raise tomllib.TOMLDecodeError(str(error)) from None


def parse_json(content: str | bytes) -> Any:  # noqa: ANN401 - whatever JSON can hold
    """Parse JSON. Raises ValueError, also for content that is nested too deep."""
    try:
        return json.loads(content)
    except RecursionError:
        raise ValueError(_TOO_DEEP) from None


def spreadsheet_cell(value: object) -> object:
    """Return a value for a CSV file: a text that begins like a formula gets an apostrophe.

    A spreadsheet would run such a text when the file is opened, and it may come from a stranger. A
    text that pandas or R reads as a missing value gets one too.
    """
    is_changed = isinstance(value, str) and (
        value.startswith(_FORMULA_STARTS) or value in _READ_AS_MISSING
    )
    return f"'{value}" if is_changed else value


def _size(count: int) -> str:
    """Return a size in the form 16 MiB or 65536 bytes."""
    return f"{count // MIB} MiB" if count >= MIB and count % MIB == 0 else f"{count} bytes"


def _is_list(key: str) -> bool:
    """Whether a line that begins with a bracket is a list of numbers and not a table's name."""
    return "," in key or "=" in key
