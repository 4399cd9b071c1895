"""Runs an encoder folder (encoder.json and encoder.onnx) on onnxruntime. Knows no gallery.

The graph holds the preprocessing: it takes "crops" (N, S, S, 4) uint8, RGB and mask (0 or 255), and
gives "embeddings" (N, D) float32 of unit norm; the shipped one also gives the probabilities of
ImageNet's "classes" (N, 1000). encoder.json states name, side, dimension and the SHA-256 of the
graph. Sessions use a fixed number of threads that sleep while they wait, so
that a busy recogniser leaves the other cores to the audio engine. A session is opened by its first
use: beside a shared recogniser most services need none, and save its memory. Networks in other ONNX
files share `open_session` (file_encoder).
"""

from __future__ import annotations

import ctypes
import hashlib
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from hapticvlm import documents
from hapticvlm.errors import short_line
from hapticvlm.vision.encoders.encoder import (
    CARD,
    DEFAULT,
    SHIPPED,
    EncoderError,
    Floats,
    Pixels,
    embed_all,
)
from hapticvlm.vision.pictures import Crop

GRAPH = "encoder.onnx"
INPUT = "crops"
OUTPUT = "embeddings"
CLASSES = "classes"  # probabilities (N, 1000)
MAX_BYTES = 2048 * documents.MIB  # no ONNX file is larger
READ_S = 60.0  # at most for a file of that size
EXTERNAL_FOLDER = "session.model_external_initializers_file_folder_path"
SILENT = 4  # onnxruntime's log level "fatal"; errors arrive as exceptions


@dataclass(frozen=True, slots=True)
class Card:
    """The content of encoder.json; sha256 maps file names to hexadecimal digests."""

    name: str
    side: int
    dimension: int
    sha256: Mapping[str, str]


@dataclass(frozen=True, slots=True)
class OnnxEncoder:
    """A session of onnxruntime behind the Encoder protocol; `revision` is its graph's SHA-256.

    `open` returns the session, the same one at each call. Raises EncoderError.
    """

    name: str
    side: int
    dimension: int
    revision: str
    open: Callable[[], Any]

    @property
    def has_classes(self) -> bool:
        """Whether it gives the probabilities of ImageNet's classes. Raises EncoderError."""
        return any(port.name == CLASSES for port in self.open().get_outputs())

    def embed(self, crops: Sequence[Crop]) -> Floats:
        """Embed N crops: (N, D) float32, each of unit norm. Raises EncoderError."""
        return embed_all(crops, self, lambda pixels: self._run(pixels, OUTPUT)[0])

    def embed_and_classify(self, crops: Sequence[Crop]) -> tuple[Floats, Floats]:
        """Return embeddings as `embed`, and probabilities of classes (N, 1000), by one pass."""
        classes = [np.zeros((0, 1000), np.float32)]

        def run(pixels: Pixels) -> Floats:
            embeddings, shares = self._run(pixels, OUTPUT, CLASSES)
            classes.append(shares)
            return embeddings

        return embed_all(crops, self, run), np.concatenate(classes)

    def _run(self, pixels: Pixels, *names: str) -> list[Floats]:
        # One crop at a time: an int8 graph takes one activation scale for a whole batch, so an
        # embedding would depend on the other crops. On one core a batch saves no time either.
        singles = (pixels[row : row + 1] for row in range(len(pixels)))
        session = self.open()
        outputs = [session.run(names, {INPUT: crop}) for crop in singles]
        return [np.concatenate(rows) for rows in zip(*outputs, strict=True)]


def load_onnx_encoder(folder: Path, threads: int = 1) -> OnnxEncoder:
    """Return the encoder of a folder. Its first use checks its file against encoder.json.

    Raises EncoderError, as does that first use.
    """
    card = read_card(folder)

    @cache
    def open_checked() -> Any:  # noqa: ANN401 - onnxruntime is untyped
        session = _open(_read_graph(folder, card), folder, threads)
        _require_fit(session, card, folder)
        return session

    return OnnxEncoder(card.name, card.side, card.dimension, card.sha256[GRAPH], open_checked)


def read_card(folder: Path) -> Card:
    """Read a folder's encoder.json. Raises EncoderError."""
    path = folder / CARD
    try:
        fields = documents.read_json(path, dict[str, Any])
        card = Card(fields["name"], fields["side"], fields["dimension"], fields["sha256"])
    except (OSError, ValueError, KeyError, TypeError) as error:
        reason = documents.reason(error)
        raise EncoderError(f"{path} cannot be read ({reason}); {_cure(folder)}") from None
    fits = isinstance(card.name, str) and isinstance(card.sha256, dict) and GRAPH in card.sha256
    if not fits or not all(type(n) is int and n > 0 for n in (card.side, card.dimension)):
        problem = f"{path} must have name, side, dimension (whole numbers above 0) and sha256 of"
        raise EncoderError(f"{problem} {GRAPH}; {_cure(folder)}")
    return card


def _read_graph(folder: Path, card: Card) -> bytes:
    path = folder / GRAPH
    try:
        data = documents.read_bytes(path, MAX_BYTES, READ_S)
    except (OSError, ValueError) as error:
        reason = documents.reason(error)
        raise EncoderError(f"{path} cannot be read ({reason}); {_cure(folder)}") from None
    if hashlib.sha256(data).hexdigest() != card.sha256[GRAPH]:
        problem = f"{path} is not the file that {CARD} describes: its SHA-256 differs"
        raise EncoderError(f"{problem}; {_cure(folder)}")
    return data


def shipped_folder(name: str | None) -> Path | None:
    """Return the folder of a shipped encoder, by its short or full name; None for any other."""
    for folder in sorted(path.parent for path in SHIPPED.glob(f"*/{CARD}")):
        if (name or DEFAULT) in (folder.name, read_card(folder).name):
            return folder
    return None


def open_session(graph: bytes, threads: int, folder: Path | None = None) -> Any:  # noqa: ANN401
    """Open the bytes of an ONNX file on the cpu; onnxruntime is untyped.

    Weights in further files are read from `folder` alone; onnxruntime refuses a path that leaves
    it. Raises exceptions of onnxruntime, which share no base class.
    """
    import onnxruntime

    onnxruntime.set_default_logger_severity(SILENT)
    options = onnxruntime.SessionOptions()
    options.log_severity_level = SILENT
    # Threads of onnxruntime spin while they wait, by default. On two cores a recogniser that waits
    # for its next picture would take half of the time that the audio engine needs, so they sleep.
    options.intra_op_num_threads = threads
    options.inter_op_num_threads = 1
    options.add_session_config_entry("session.intra_op.allow_spinning", "0")
    options.add_session_config_entry("session.inter_op.allow_spinning", "0")
    options.add_session_config_entry("session.load_model_format", "ONNX")  # no other format
    if folder is not None:
        options.add_session_config_entry(EXTERNAL_FOLDER, str(folder.resolve()))
    options.graph_optimization_level = onnxruntime.GraphOptimizationLevel.ORT_ENABLE_ALL
    session = onnxruntime.InferenceSession(graph, options, providers=["CPUExecutionProvider"])
    session._model_bytes = None  # it would keep the file, to change providers
    if sys.platform == "linux" and hasattr(libc := ctypes.CDLL(None), "malloc_trim"):
        libc.malloc_trim(0)  # glibc keeps what loading has freed; musl has no such function
    return session


def _open(graph: bytes, folder: Path, threads: int) -> Any:  # noqa: ANN401
    import onnxruntime

    try:
        return open_session(graph, threads)
    except Exception as error:  # noqa: BLE001 - onnxruntime's errors share no base of their own
        problem = f"{folder / GRAPH}: onnxruntime {onnxruntime.__version__} cannot load it"
        raise EncoderError(f"{problem} ({short_line(error)}); {_cure(folder)}") from None


def _require_fit(session: Any, card: Card, folder: Path) -> None:  # noqa: ANN401
    side = card.side
    expected = (
        (INPUT, "tensor(uint8)", (side, side, 4)),
        (OUTPUT, "tensor(float)", (card.dimension,)),
    )
    given = [port for port in session.get_outputs() if port.name != CLASSES]
    actual = (session.get_inputs(), given)
    for (name, type_, shape), ports in zip(expected, actual, strict=True):
        described = [(port.name, port.type, port.shape) for port in ports]
        if (
            len(ports) != 1
            or described[0][:2] != (name, type_)
            or not _fits(described[0][2], shape)
        ):
            problem = f"{folder / GRAPH} has {described}, but {CARD} needs {name}, {type_} of (N, "
            raise EncoderError(f"{problem}{', '.join(map(str, shape))}); {_cure(folder)}")


def _fits(actual: Sequence[object], expected: tuple[int, ...]) -> bool:
    """Whether a graph's shape is any N, then `expected`; its symbols (not int) allow any size."""
    if len(actual) != len(expected) + 1 or isinstance(actual[0], int):
        return False
    pairs = zip(actual[1:], expected, strict=True)
    return all(size == want or not isinstance(size, int) for size, want in pairs)


def _cure(folder: Path) -> str:
    return (
        "reinstall hapticvlm"
        if folder.parent == SHIPPED
        else "export or copy the folder again, whole"
    )
