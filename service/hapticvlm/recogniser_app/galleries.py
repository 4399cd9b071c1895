"""The galleries of a replica by name, each with its identity; replaced as a whole. Knows no Ray."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from hapticvlm import __version__
from hapticvlm.recognition.encoders.encoder import Encoder, NetworkEncoder
from hapticvlm.recognition.encoders.onnx_encoder import OnnxEncoder
from hapticvlm.recognition.galleries.gallery import Gallery
from hapticvlm.recognition.galleries.storage import gallery_bytes, load_gallery
from hapticvlm.recognition.remote.contract import CONTRACT, SHIPPED, Identity

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


@dataclass(frozen=True, slots=True)
class Named:
    """A gallery and what it and the encoder are together. One request is answered by one of it."""

    identity: Identity
    gallery: Gallery


def load_galleries(paths: Mapping[str, str], encoder: Encoder) -> dict[str, Named]:
    """Load every gallery, the shipped one too. Raises GalleryError and MaterialError."""
    found = {SHIPPED: load_gallery(encoder=encoder)}
    found |= {name: load_gallery(Path(path), encoder=encoder) for name, path in paths.items()}
    return {
        name: Named(identify(encoder, gallery, name), gallery) for name, gallery in found.items()
    }
