"""Reads the nodes of an ONNX model and adds inner tensors to its outputs; needs no onnx package.

An ONNX file is one protobuf message: a sequence of fields, each a key (number << 3 | wire type) and
a value, which for strings and nested messages is a length and that many bytes. Two facts keep this
file small. A reader may skip every field that it does not know, so only the names in the graph's
nodes, and of files of weights, are decoded and no weight is touched. And protobuf merges a nested
message that occurs again: lists are joined. So bytes that hold a graph of one output, written
behind the model, make that tensor an output of the whole model.

Only what is needed of https://github.com/onnx/onnx/blob/main/onnx/onnx.proto; no tensor is read.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

VARINT, FIXED64, BYTES, FIXED32 = 0, 1, 2, 5  # wire types; groups (3, 4) are not in ONNX
GRAPH = 7  # field numbers: of ModelProto
NODE, WEIGHTS, OUTPUT = 1, 5, 12  # of GraphProto
EXTERNAL = 13  # of TensorProto: entries of a key and a value
ENTRY_KEY, ENTRY_VALUE = 1, 2
NODE_INPUT, NODE_OUTPUT, NODE_TYPE = 1, 2, 4  # of NodeProto
VALUE_NAME = 1  # of ValueInfoProto


@dataclass(frozen=True, slots=True)
class Node:
    """An operation and the names of the tensors that it reads and gives."""

    kind: str
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Graph:
    """The nodes of a model in the order of computation, and the names of its outputs.

    weight_files: paths, from the model's folder, of the files that hold weights beside it.
    """

    nodes: tuple[Node, ...]
    outputs: tuple[str, ...]
    weight_files: tuple[str, ...] = ()


def read_graph(model: bytes) -> Graph:
    """Read the graph of an ONNX file's bytes. Raises ValueError for what is not an ONNX model."""
    nodes: list[Node] = []
    outputs: list[str] = []
    weight_files: list[str] = []
    for number, graph in _fields(memoryview(model)):
        if number != GRAPH:
            continue
        for part, value in _fields(graph):
            if part == NODE:
                nodes.append(_node(value))
            elif part == OUTPUT:
                outputs += _names(value, VALUE_NAME)
            elif part == WEIGHTS:
                weight_files += _locations(value)
    if not nodes or not outputs:
        raise ValueError("it does not hold an ONNX model")
    return Graph(tuple(nodes), tuple(outputs), tuple(dict.fromkeys(weight_files)))


def with_outputs(model: bytes, names: Sequence[str]) -> bytes:
    """Return the model with these tensors of its graph as further outputs."""
    values = (_written(OUTPUT, _written(VALUE_NAME, name.encode())) for name in names)
    return model + b"".join(_written(GRAPH, value) for value in values)


def _node(data: memoryview) -> Node:
    kinds = _names(data, NODE_TYPE)
    inputs = tuple(_names(data, NODE_INPUT))
    return Node(kinds[-1] if kinds else "", inputs, tuple(_names(data, NODE_OUTPUT)))


def _locations(tensor: memoryview) -> list[str]:
    """Return the path of the file that holds a tensor's numbers, if it is not in the model."""
    entries = [value for number, value in _fields(tensor) if number == EXTERNAL]
    return [
        path
        for entry in entries
        if _names(entry, ENTRY_KEY) == ["location"]
        for path in _names(entry, ENTRY_VALUE)
    ]


def _names(data: memoryview, field: int) -> list[str]:
    return [bytes(value).decode() for number, value in _fields(data) if number == field]


def _fields(data: memoryview) -> Iterator[tuple[int, memoryview]]:
    """Yield number and bytes of each field with a length; skip numbers. Raises ValueError."""
    at = 0
    while at < len(data):
        key, at = _varint(data, at)
        number, wire_type = key >> 3, key & 7
        if wire_type == VARINT:
            _, at = _varint(data, at)
            continue
        if wire_type == BYTES:
            size, at = _varint(data, at)
        elif wire_type in (FIXED64, FIXED32):
            size = 8 if wire_type == FIXED64 else 4
        else:
            raise ValueError("it does not hold an ONNX model")
        if size > len(data) - at:
            raise ValueError("it ends in the middle of a field")
        if wire_type == BYTES:
            yield number, data[at : at + size]
        at += size


def _varint(data: memoryview, at: int) -> tuple[int, int]:
    """Read a number of seven bits a byte, the lowest first; also return where it ends."""
    value = 0
    for shift in range(0, 64, 7):
        if at >= len(data):
            raise ValueError("it ends in the middle of a number")
        byte = data[at]
        at += 1
        value |= (byte & 0x7F) << shift
        if byte < 0x80:
            return value, at
    raise ValueError("it does not hold an ONNX model")


def _written(number: int, value: bytes) -> bytes:
    return _varint_of(number << 3 | BYTES) + _varint_of(len(value)) + value


def _varint_of(value: int) -> bytes:
    parts = bytearray()
    while value > 0x7F:
        parts.append(value & 0x7F | 0x80)
        value >>= 7
    parts.append(value)
    return bytes(parts)
