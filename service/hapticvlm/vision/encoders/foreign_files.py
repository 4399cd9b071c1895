"""Recognises files that hold another kind of network, or none, by their first bytes.

A file is named by its content, because endings are wrong as often as the content is. Each kind
comes with what turns it into a file that can be read. Nothing of a file is run or unpacked.
"""

from __future__ import annotations

from pathlib import Path

from hapticvlm.vision.encoders.encoder import EncoderError

HEAD_BYTES = 512
_TORCH = "a network of PyTorch", "load it in PyTorch and write FILE.onnx with torch.onnx.export"
_TO_ONNX = "convert it to ONNX with tf2onnx and name that"
_UNPACK = "unpack it and name the .onnx file in it"
_PAGE = (
    "a web page, not a network",
    "download the file itself (on GitHub: Raw; on the hub: download)",
)
_LFS = "fetch the file with `git lfs pull`, or download it from the page of its repository"
_GGUF = "a model of text and pictures is reached with --vlm-url; name an image network in ONNX"
_TENSORS = "name the folder that holds them beside config.json and preprocessor_config.json"
_ZIP = b"PK\x03\x04"
# Where a mark stands, the mark, what else the first bytes hold; name and cure. The order counts: a
# ZIP archive of a known content comes before any other.
KINDS = (
    (0, b"version https://git-lfs", b"", "a pointer of git-LFS, not the network itself", _LFS),
    (0, b"<!doctype html", b"", *_PAGE),
    (0, b"<html", b"", *_PAGE),
    (0, _ZIP, b"/data.pkl", *_TORCH),
    (0, _ZIP, b"constants.pkl", *_TORCH),
    (0, b"\x80\x02", b"", "pickled weights of PyTorch", _TORCH[1]),
    (0, _ZIP, b".tflite", "a bundle of MediaPipe", f"unpack it, of the network in it: {_TO_ONNX}"),
    (0, _ZIP, b"metadata.json", "a network of Keras", _TO_ONNX),
    (0, _ZIP, b"", "a ZIP archive", _UNPACK),
    (0, b"\x1f\x8b", b"", "a gzip archive", _UNPACK),
    (0, b"\x89HDF\r\n\x1a\n", b"", "an HDF5 file of Keras", _TO_ONNX),
    (4, b"TFL3", b"", "a TFLite file", _TO_ONNX),
    (0, b"GGUF", b"", "a GGUF file for llama.cpp", _GGUF),
    (8, b"{", b'"dtype"', "weights in safetensors, without their network", _TENSORS),
    (
        0,
        b"{",
        b'"format"',
        "a network of TensorFlow.js",
        f"tensorflowjs_converter, then {_TO_ONNX}",
    ),
    (0, b"{", b"", "a JSON file, not a network", "name the .onnx file, or a network's folder"),
)


def require_no_foreign_file(path: Path) -> None:
    """Refuse a file of another kind by its name. Raises EncoderError with what converts it."""
    try:
        with path.open("rb") as file:
            head = file.read(HEAD_BYTES)
    except OSError as error:
        raise EncoderError(f"encoder `{path}`: {error.strerror}; name another file") from None
    for at, mark, within, name, cure in KINDS:
        if head[at : at + len(mark)].lower() == mark.lower() and within in head:
            raise EncoderError(f"encoder `{path}` is {name}; {cure}")
