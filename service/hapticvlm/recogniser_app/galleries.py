"""The galleries of a replica by name, each with its identity; replaced as a whole. Knows no Ray."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from hapticvlm.recognition.encoders.encoder import Encoder
from hapticvlm.recognition.galleries.gallery import Gallery
from hapticvlm.recognition.galleries.storage import load_gallery
from hapticvlm.recognition.remote.contract import SHIPPED, Identity
from hapticvlm.recognition.remote.identity import identify


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
