"""Reads one request and writes its answer, without HTTP and without Ray; holds named galleries.

A fault of the request raises Refusal with an HTTP status; any other exception is a fault of ours.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import msgspec

from hapticvlm import __version__
from hapticvlm.vision.encoders import living
from hapticvlm.vision.encoders.encoder import Encoder, Floats, NetworkEncoder
from hapticvlm.vision.encoders.onnx_encoder import OnnxEncoder
from hapticvlm.vision.flatness import is_flat
from hapticvlm.vision.galleries.gallery import Gallery
from hapticvlm.vision.galleries.storage import gallery_bytes, load_gallery
from hapticvlm.vision.pictures import Crop
from hapticvlm.vision.remote import contract
from hapticvlm.vision.remote.contract import (
    CONTRACT,
    SHIPPED,
    Answer,
    ContractError,
    Identity,
    RemoteMatch,
    Result,
)

DIGITS = 16  # hexadecimal, of SHA-256: enough to notice a mistake, not to stop a forger
OVERHEAD_BYTES = 64 * 1024  # of a request beside its pixels


class Refusal(Exception):
    """Raised when a request is refused: an HTTP status and the reason."""

    def __init__(self, status: int, reason: str) -> None:
        super().__init__(reason)
        self.status = status


def identify(encoder: Encoder, gallery: Gallery, name: str) -> Identity:
    """Return the identity of an encoder with a gallery, whose hash changes with either.

    A network in a folder has no revision, so only its name and shape identify it.
    """
    revision = encoder.revision if isinstance(encoder, OnnxEncoder | NetworkEncoder) else ""
    model = [encoder.name, revision, encoder.side, encoder.dimension]
    rest = sorted(gallery.parents.items())
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
    """A gallery with its identity. A request keeps the one it began with, even across a reload."""

    identity: Identity
    gallery: Gallery


def load_galleries(paths: Mapping[str, str], encoder: Encoder) -> dict[str, Named]:
    """Load the shipped gallery and those at `paths`. Raises GalleryError and MaterialError."""
    galleries = {SHIPPED: load_gallery(encoder=encoder)}
    galleries |= {name: load_gallery(Path(path), encoder=encoder) for name, path in paths.items()}
    return {
        name: Named(identify(encoder, gallery, name), gallery)
        for name, gallery in galleries.items()
    }


@dataclass(frozen=True, slots=True)
class Job:
    """A decoded request: crops, the gallery to match, and until when (s) its caller waits."""

    crops: tuple[Crop, ...]
    named: Named
    until: float


@dataclass(frozen=True, slots=True)
class Embedded:
    """One crop's embedding (D,) float32, the size of its batch, and the times of its stages, ms.

    `alive` is the belief that it shows a person or an animal.
    """

    embedding: Floats
    batch: int
    queue_ms: float
    encode_ms: float
    alive: float = 0.0


def most_bytes(side: int) -> int:
    """Return the size of the largest valid request to an encoder of this input side, bytes."""
    return contract.MAX_CROPS * 4 * side * side + OVERHEAD_BYTES


def find(galleries: Mapping[str, Named], name: str) -> Named:
    """Return the gallery of this name. Raises Refusal, which names no other gallery.

    Galleries may belong to different operators, who need not know of each other.
    """
    named = galleries.get(name)
    if named is None:
        raise Refusal(404, f"no gallery `{name[:64]}`")
    return named


def read_job(data: bytes, galleries: Mapping[str, Named], now: float) -> Job:
    """Decode a request's body; `now` is in s. Raises Refusal."""
    try:
        request = contract.read_request(data)
        named = find(galleries, request.gallery)
        side = named.identity.side
        crops = tuple(contract.read_crop(sent, side) for sent in request.crops)
    except ContractError as error:
        raise Refusal(422, str(error)) from None
    return Job(crops, named, now + request.wait_ms / 1000.0)


def write_answer(job: Job, embedded: Sequence[Embedded | None]) -> bytes:
    """Match the embeddings and encode the answer. Raises Refusal when one came too late."""
    complete = [result for result in embedded if result is not None]
    if len(complete) < len(embedded):
        raise Refusal(504, "the caller's wait_ms has passed: not recognised")
    pairs = zip(complete, job.crops, strict=True)
    results = [_result(job.named.gallery, result, crop) for result, crop in pairs]
    stages = {
        "queue": max(result.queue_ms for result in complete),
        "encode": max(result.encode_ms for result in complete),
    }
    identity = job.named.identity
    batch = max(result.batch for result in complete)
    answer = Answer(identity.gallery, identity.hash, results, batch, stages)
    return msgspec.msgpack.encode(answer)


def _result(gallery: Gallery, embedded: Embedded, crop: Crop) -> Result:
    matched = gallery.match(embedded.embedding, is_flat=is_flat(crop))
    evidence = living.with_living(matched, embedded.alive)
    return contract.write_result(RemoteMatch(evidence, embedded.embedding))
