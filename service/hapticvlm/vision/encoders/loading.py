"""An encoder by name: the one shipped, a folder's, a file's, or a network of transformers."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from hapticvlm.vision.encoders.encoder import CARD, DEFAULT, SHIPPED, Encoder, EncoderError
from hapticvlm.vision.encoders.onnx_encoder import load_onnx_encoder, read_card
from hapticvlm.vision.pictures import Crop, central_mask

FILES = (".onnx", ".tflite")  # TFLite only to say that it is not read
DEVICES = ("cpu", "cuda", "auto")


def load_encoder(name: str | None = None, *, device: str = "cpu", threads: int = 1) -> Encoder:
    """Load an encoder and embed with it once, so that the next inference is not a slow first one.

    name: None = the shipped one; lite0 or lite2, which ship, or their full names; a folder with an
    encoder.json; a file .onnx; or a network of transformers, by folder or by name.
    device: cpu, cuda or auto; those that are not of transformers run on the cpu. threads: of one
    inference. Raises EncoderError.
    """
    if device not in DEVICES:
        raise EncoderError(f"device {device!r} is none of {', '.join(DEVICES)}")
    if threads < 1:
        raise EncoderError(f"{threads} threads: an inference needs 1 or more")
    encoder = _find(name, device, threads)
    blank = Crop(
        np.full((encoder.side, encoder.side, 3), 127, np.uint8), central_mask(encoder.side)
    )
    encoder.embed([blank])
    return encoder


def _find(name: str | None, device: str, threads: int) -> Encoder:
    """Load what `name` names; torch is imported only for a network of transformers."""
    shipped = shipped_folder(name)
    folder = shipped or Path(str(name)).expanduser()
    is_file = shipped is None and folder.suffix.lower() in FILES
    if shipped is None and not is_file and not (folder / CARD).is_file():
        from hapticvlm.vision.encoders.transformers_encoder import load_transformers_encoder

        return load_transformers_encoder(str(name), device, threads)
    if device == "cuda":
        text = "--encoder-device cuda is for networks of transformers; this encoder runs on the cpu"
        raise EncoderError(f"{text}: leave --encoder-device out")
    if is_file:
        from hapticvlm.vision.encoders.file_encoder import load_file_encoder

        return load_file_encoder(folder, threads)
    return load_onnx_encoder(folder, threads)


def shipped_folder(name: str | None) -> Path | None:
    """Return the folder of an encoder that ships, by its short or full name; None for another."""
    for folder in sorted(path.parent for path in SHIPPED.glob(f"*/{CARD}")):
        if (name or DEFAULT) in (folder.name, read_card(folder).name):
            return folder
    return None


def is_quick(name: str | None) -> bool:
    """Whether an encoder is one that ships, or lies in a folder for onnxruntime: loaded at once."""
    return shipped_folder(name) is not None or (Path(str(name)) / CARD).is_file()
