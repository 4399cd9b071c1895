"""Loads an encoder by name: a shipped one, a folder, an ONNX file, or a network of transformers."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from hapticvlm.vision.encoders.encoder import CARD, Encoder, EncoderError
from hapticvlm.vision.encoders.file_encoder import FileEncoder, load_file_encoder
from hapticvlm.vision.encoders.foreign_files import require_no_foreign_file
from hapticvlm.vision.encoders.onnx_encoder import load_onnx_encoder, shipped_folder
from hapticvlm.vision.galleries.storage import best_prepared
from hapticvlm.vision.pictures import Crop, central_mask

FILE = ".onnx"
SAME = 1e-6  # distance of two unit embeddings, below which they count as one
STRIPES = ((220, 90, 10), (20, 40, 60))  # RGB of a picture that is nothing like plain grey
DEVICES = ("cpu", "cuda", "auto")


def load_encoder(
    name: str | None = None, *, device: str = "cpu", threads: int = 1, on_use: bool = False
) -> Encoder:
    """Load an encoder, and embed two pictures with it: it must tell them apart.

    The next inference is therefore not a slow first one. `on_use`: one that ships is loaded by its
    first inference, and not before.

    name: None for the default; lite0, which ships, or its full name; a folder with an encoder.json;
    an ONNX file; or a network of transformers, by folder or by name.
    device: cpu, cuda or auto; only networks of transformers run on a GPU. threads: of one
    inference. Raises EncoderError.
    """
    if device not in DEVICES:
        raise EncoderError(f"`{device}` is not a device; it must be one of {', '.join(DEVICES)}")
    if threads < 1:
        raise EncoderError(f"{threads} threads are too few; an inference needs 1 or more")
    encoder = _find(name, device, threads)
    if isinstance(encoder, FileEncoder) and encoder.preparations:
        encoder = best_prepared(encoder)
    if on_use and shipped_folder(name) is not None:
        return encoder
    mask = central_mask(encoder.side)
    grey = np.full((encoder.side, encoder.side, 3), 127, np.uint8)
    stripes = grey.copy()
    for offset, colour in enumerate(STRIPES):
        stripes[offset :: len(STRIPES)] = colour
    plain, striped = (encoder.embed([Crop(image, mask)])[0] for image in (grey, stripes))
    if np.linalg.norm(plain - striped) < SAME:
        problem = f"encoder `{encoder.name}` gives the same features for plain grey and for stripes"
        raise EncoderError(
            f"{problem}, so it can tell no material; name a network that was trained on pictures"
        )
    return encoder


def _find(name: str | None, device: str, threads: int) -> Encoder:
    """Load an encoder by name; torch is imported only for a network of transformers."""
    shipped = shipped_folder(name)
    folder = shipped or Path(str(name)).expanduser()
    if folder.is_file():
        require_no_foreign_file(folder)
    is_file = shipped is None and (folder.is_file() or folder.suffix.lower() == FILE)
    if shipped is None and not is_file and not (folder / CARD).is_file():
        from hapticvlm.vision.encoders.transformers_encoder import load_transformers_encoder

        return load_transformers_encoder(str(name), device, threads)
    if device == "cuda":
        problem = "--encoder-device cuda: only networks of transformers run on a GPU"
        raise EncoderError(f"{problem}; leave --encoder-device out")
    if is_file:
        return load_file_encoder(folder, threads)
    return load_onnx_encoder(folder, threads)


def is_quick(name: str | None) -> bool:
    """Whether an encoder loads at once: it ships, or lies in a folder with an encoder.json."""
    return shipped_folder(name) is not None or (Path(str(name)) / CARD).is_file()
