"""Files in torch's older format, put together by hand: whole ones, and what nobody should trust."""

from __future__ import annotations

import pickle
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from hapticvlm.vision.encoders.packaged_weights import MAGIC, VERSION

MARK, TUPLE, REDUCE, PERSISTENT, SET, STOP = b"(", b"t", b"R", b"Q", b"s", b"."


@dataclass(frozen=True)
class Tensor:
    """A view of one storage of float32."""

    shape: tuple[int, ...] = (2, 3)
    strides: tuple[int, ...] = (3, 1)
    offset: int = 0
    key: str = "k"
    count: int = 6


def file_of(
    tensors: Mapping[str, Tensor], storages: Mapping[str, Sequence[float]], *, pickled: bytes = b""
) -> bytes:
    """Return a whole file; `pickled` stands in for its third pickle, what the machine was like."""
    machine = pickled or pickle.dumps({"little_endian": True}, 2)
    body = b"}" + b"".join(_text(name) + _tensor(given) + SET for name, given in tensors.items())
    head = pickle.dumps(MAGIC, 2) + pickle.dumps(VERSION, 2) + machine
    parts = [head, b"\x80\x02", body, STOP, pickle.dumps(list(storages), 2)]
    parts += [struct.pack(f"<q{len(row)}f", len(row), *row) for row in storages.values()]
    return b"".join(parts)


def calling(module: str, name: str, argument: str) -> bytes:
    """Return a pickle that would call a function by its name, as a hostile file does."""
    return b"\x80\x02" + _global(module, name) + MARK + _text(argument) + TUPLE + REDUCE + STOP


def _tensor(given: Tensor) -> bytes:
    storage = MARK + _text("storage") + _global("torch", "FloatStorage") + _text(given.key)
    storage += _text("cpu") + _int(given.count) + b"N" + TUPLE + PERSISTENT
    view = _int(given.offset) + _tuple(given.shape) + _tuple(given.strides)
    rebuild = _global("torch._utils", "_rebuild_tensor_v2")
    return rebuild + MARK + storage + view + TUPLE + REDUCE


def _global(module: str, name: str) -> bytes:
    return f"c{module}\n{name}\n".encode()


def _text(text: str) -> bytes:
    return b"X" + struct.pack("<I", len(text)) + text.encode()


def _int(number: int) -> bytes:
    return f"I{number}\n".encode()


def _tuple(numbers: Sequence[int]) -> bytes:
    return MARK + b"".join(map(_int, numbers)) + TUPLE
