"""Recognises files that hold another kind of network, or none, by their first bytes.

A file is named by its content, because endings are wrong as often as the content is. Each kind
comes with what turns it into a file that can be read. Nothing of a file is run or unpacked.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from hapticvlm.vision.encoders.encoder import EncoderError

HEAD_BYTES = 512
_FROM_TORCH = "load it in PyTorch and write FILE.onnx with torch.onnx.export"
_FROM_TENSORFLOW = "convert it to ONNX with tf2onnx and name that"
_FROM_BUNDLE = "unpack it, convert the image network in it to ONNX with tf2onnx and name that"


@dataclass(frozen=True, slots=True)
class ForeignKind:
    """A kind of file that is not read: `mark` at byte `at`, and `within` its first bytes."""

    name: str
    cure: str
    mark: bytes
    at: int = 0
    within: bytes = b""


_ZIP = b"PK\x03\x04"
# The order counts: a ZIP archive of a known content comes before any other.
KINDS = (
    ForeignKind(
        "a pointer of git-LFS, not the network itself",
        "fetch the file with `git lfs pull`, or download it from the page of its repository",
        b"version https://git-lfs",
    ),
    ForeignKind(
        "a web page, not a network",
        "download the file itself (on GitHub: Raw; on the hub: download)",
        b"<!doctype html",
    ),
    ForeignKind("a web page, not a network", "download the file itself", b"<html"),
    ForeignKind("a network of PyTorch", _FROM_TORCH, _ZIP, within=b"/data.pkl"),
    ForeignKind("a network of PyTorch", _FROM_TORCH, _ZIP, within=b"constants.pkl"),
    ForeignKind("pickled weights of PyTorch", _FROM_TORCH, b"\x80\x02"),
    ForeignKind("a bundle of MediaPipe", _FROM_BUNDLE, _ZIP, within=b".tflite"),
    ForeignKind("a network of Keras", _FROM_TENSORFLOW, _ZIP, within=b"metadata.json"),
    ForeignKind("a ZIP archive", "unpack it and name the .onnx file in it", _ZIP),
    ForeignKind("a gzip archive", "unpack it and name the .onnx file in it", b"\x1f\x8b"),
    ForeignKind("an HDF5 file of Keras", _FROM_TENSORFLOW, b"\x89HDF\r\n\x1a\n"),
    ForeignKind("a TFLite file", _FROM_TENSORFLOW, b"TFL3", at=4),
    ForeignKind(
        "a GGUF file for llama.cpp",
        "a model of text and pictures is reached with --vlm-url; name an image network in ONNX",
        b"GGUF",
    ),
    ForeignKind(
        "weights in safetensors, without their network",
        "name the folder that holds them beside config.json and preprocessor_config.json",
        b"{",
        at=8,
        within=b'"dtype"',
    ),
    ForeignKind(
        "a network of TensorFlow.js",
        "convert it back with tensorflowjs_converter, then to ONNX with tf2onnx",
        b"{",
        within=b'"format"',
    ),
    ForeignKind(
        "a JSON file, not a network",
        "name the .onnx file, or the folder of a network of transformers",
        b"{",
    ),
)


def kind_of(head: bytes) -> ForeignKind | None:
    """Return the kind whose marks a file's first HEAD_BYTES hold; None: it may be readable."""
    for kind in KINDS:
        start = head[kind.at : kind.at + len(kind.mark)]
        if start.lower() == kind.mark.lower() and kind.within in head:
            return kind
    return None


def require_no_foreign_file(path: Path) -> None:
    """Refuse a file of another kind by its name. Raises EncoderError with what converts it."""
    try:
        with path.open("rb") as file:
            head = file.read(HEAD_BYTES)
    except OSError as error:
        raise EncoderError(f"encoder `{path}`: {error.strerror}; name another file") from None
    kind = kind_of(head)
    if kind is not None:
        raise EncoderError(f"encoder `{path}` is {kind.name}; {kind.cure}")
