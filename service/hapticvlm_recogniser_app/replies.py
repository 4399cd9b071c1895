"""One request to a replica and its reply, without HTTP and without Ray; its galleries by name.

What is wrong with a request is its caller's fault and refused with a status; nothing else is.
"""

from __future__ import annotations

import hashlib
import hmac
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import msgspec

from hapticvlm import __version__
from hapticvlm.vision.encoders.encoder import Encoder, Floats, NetworkEncoder
from hapticvlm.vision.encoders.onnx_encoder import OnnxEncoder
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
)

DIGITS = 16  # hexadecimal, of SHA-256: mistakes are to be noticed, not forgeries
CROP_BYTES = 64 * 1024  # of a request beside its pixels


class Refusal(Exception):
    """A request that is not answered: HTTP status and why."""

    def __init__(self, status: int, text: str) -> None:
        super().__init__(text)
        self.status = status


def identify(encoder: Encoder, gallery: Gallery, name: str) -> Identity:
    """Return the identity of this encoder with the gallery of this name.

    A network in a folder has no revision: only its name and shape identify it.
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


@dataclass(frozen=True, slots=True)
class Job:
    """What a request asks: its crops, the gallery to match, until when its caller waits, s."""

    crops: tuple[Crop, ...]
    named: Named
    until: float


@dataclass(frozen=True, slots=True)
class Embedded:
    """One crop's embedding (D,), the size of its batch, and the times of its stages, ms."""

    embedding: Floats
    batch: int
    queue_ms: float
    encode_ms: float


def check_token(token: str | None, header: str | None) -> None:
    """Admit who knows the token; None: everybody. Raises Refusal."""
    if token is None:
        return
    scheme, _, given = (header or "").partition(" ")
    if scheme.lower() != "bearer" or not hmac.compare_digest(given.encode(), token.encode()):
        raise Refusal(401, "send the token of this recogniser as `Authorization: Bearer TOKEN`")


def most_bytes(side: int) -> int:
    """Most bytes a request to an encoder of this side can have."""
    return contract.MAX_CROPS * 4 * side * side + CROP_BYTES


def find(galleries: Mapping[str, Named], name: str) -> Named:
    """Find a gallery. Raises Refusal, which lists no others: they are other people's."""
    named = galleries.get(name)
    if named is None:
        raise Refusal(404, f"there is no gallery `{name[:64]}` here")
    return named


def read_job(data: bytes, galleries: Mapping[str, Named], now: float) -> Job:
    """Read a request's body. Raises Refusal."""
    try:
        request = contract.read_request(data)
        named = find(galleries, request.gallery)
        side = named.identity.side
        crops = tuple(contract.read_crop(sent, side) for sent in request.crops)
    except ContractError as error:
        raise Refusal(422, str(error)) from None
    return Job(crops, named, now + request.wait_ms / 1000.0)


def write_answer(job: Job, embedded: Sequence[Embedded | None]) -> bytes:
    """Match the embeddings and write the answer. Raises Refusal when one came too late."""
    done = [result for result in embedded if result is not None]
    if len(done) < len(embedded):
        raise Refusal(504, "nobody waits for it any more: it was not recognised")
    results = [
        contract.write_result(
            RemoteMatch(job.named.gallery.match(result.embedding), result.embedding)
        )
        for result in done
    ]
    stages = {
        "queue": max(result.queue_ms for result in done),
        "encode": max(result.encode_ms for result in done),
    }
    identity = job.named.identity
    batch = max(result.batch for result in done)
    answer = Answer(identity.gallery, identity.hash, results, batch, stages)
    return msgspec.msgpack.encode(answer)
