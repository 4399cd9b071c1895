"""What identifies one encoder with one gallery: a hash over all that decides."""

from __future__ import annotations

import hashlib
import json

from hapticvlm import __version__
from hapticvlm.recognition.encoders.encoder import Encoder, NetworkEncoder
from hapticvlm.recognition.encoders.onnx_encoder import OnnxEncoder
from hapticvlm.recognition.galleries.gallery import Gallery
from hapticvlm.recognition.galleries.storage import gallery_bytes
from hapticvlm.recognition.remote.contract import CONTRACT, Identity

DIGITS = 16  # hexadecimal, of SHA-256: mistakes are to be noticed, not forgeries


def identify(encoder: Encoder, gallery: Gallery, name: str) -> Identity:
    """Return the identity of this encoder with the gallery of this name.

    A network in a folder has no revision: only its name and shape identify it.
    """
    revision = encoder.revision if isinstance(encoder, OnnxEncoder | NetworkEncoder) else ""
    model = [encoder.name, revision, encoder.side, encoder.dimension]
    rest = [gallery.pictures, sorted(gallery.parents.items())]
    digest = hashlib.sha256(json.dumps([model, rest]).encode())
    digest.update(gallery_bytes(gallery))
    return Identity(
        CONTRACT,
        f"hapticvlm {__version__}",
        encoder.name,
        name,
        digest.hexdigest()[:DIGITS],
        encoder.side,
        encoder.dimension,
        list(gallery.candidates),
    )
