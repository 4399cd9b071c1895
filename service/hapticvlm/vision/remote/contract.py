"""Defines the HTTP contract of a shared recogniser, version 1: requests and answers. Pure.

    POST /v1/recognise               MessagePack Request -> MessagePack Answer
    GET  /v1/identity?gallery=NAME   JSON Identity
    GET  /v1/health                  JSON counts of the replica that answers
    GET  /v1/ready                   200 once the encoder and its galleries are loaded

A crop is a square of the encoder's side with its mask, cut on the client's machine from an object
or a texture map; whole frames are never sent. Errors are JSON {"error": text} with a status of 400
or more. A newer contract has another path. Requests with unknown fields are refused, unknown fields
of answers are ignored.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Literal

import msgspec
import numpy as np
from msgspec import Meta
from numpy.typing import NDArray

from hapticvlm.errors import HapticVLMError
from hapticvlm.evidence.ladder import Evidence
from hapticvlm.materials import LIVING
from hapticvlm.messages import WHOLE, Frame
from hapticvlm.vision import pictures
from hapticvlm.vision.encoders.encoder import UNIT_ERROR
from hapticvlm.vision.pictures import Crop, PictureError

CONTRACT = 1
RECOGNISE = "/v1/recognise"
IDENTITY = "/v1/identity"
HEALTH = "/v1/health"
READY = "/v1/ready"
MESSAGEPACK = "application/msgpack"
SHIPPED = "shipped"  # the gallery that every recogniser has
MAX_CROPS = 64
MAX_ANSWER_BYTES = 4 << 20
SUM_ERROR = 1e-3  # of the beliefs, above 1
MAX_NAME = 200  # characters of its own names, which appear in /status and in logs
MAX_MATERIALS = 4096

Format = Literal["rgba8", "jpeg"]
Name = Annotated[str, Meta(max_length=MAX_NAME)]
GalleryName = Annotated[str, Meta(pattern=r"^[a-z0-9][a-z0-9._-]{0,63}$")]


class ContractError(HapticVLMError):
    """A request or an answer does not follow the contract; the message names the field and why."""


class SentCrop(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A crop of S x S pixels. rgba8: S rows of S pixels, with the mask (0 or 255) as alpha.

    jpeg: `mask` holds a bit per pixel, row by row, the highest bit first (ceil(S S / 8) bytes);
    without it the central disc counts.
    """

    format: Format
    image: bytes
    mask: bytes | None = None


class Request(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Crops to recognise with one gallery; the caller waits `wait_ms` for the answer."""

    crops: Annotated[list[SentCrop], Meta(min_length=1, max_length=MAX_CROPS)]
    gallery: GalleryName = SHIPPED
    wait_ms: Annotated[float, Meta(ge=1.0, le=60_000.0)] = 1000.0


class Identity(msgspec.Struct, frozen=True):
    """The encoder and gallery of a recogniser; `hash` identifies the pair."""

    contract: int
    service: Name
    encoder: Name
    gallery: Name
    hash: Name
    side: Annotated[int, Meta(ge=1, le=2048)]
    dimension: Annotated[int, Meta(ge=1, le=65_536)]
    materials: Annotated[list[Name], Meta(max_length=MAX_MATERIALS)]


class Result(msgspec.Struct, frozen=True):
    """The result for one crop: (material, belief), best first; the unit embedding as <f4 bytes.

    Without a belief above 0 it counts as no answer, and the caller recognises the crop itself.
    """

    beliefs: list[tuple[str, float]]
    embedding: bytes


class Answer(msgspec.Struct, frozen=True):
    """A result for each crop, in order; `hash` identifies the encoder and gallery.

    `batch` is the size of the largest batch in which one of the crops was embedded.
    """

    gallery: str
    hash: str
    results: list[Result]
    batch: int = 1
    stages_ms: dict[str, float] = {}


@dataclass(frozen=True, slots=True)
class RemoteMatch:
    """The evidence on one crop and its embedding (D,) float32."""

    evidence: Evidence
    embedding: NDArray[np.float32]


def write_request(crops: Sequence[Crop], gallery: str = SHIPPED, *, wait_ms: float) -> bytes:
    """Return the bytes of a request."""
    return msgspec.msgpack.encode(Request([_rgba(crop) for crop in crops], gallery, wait_ms))


def read_request(data: bytes) -> Request:
    """Read a request; its crops are still encoded. Raises ContractError."""
    try:
        return msgspec.msgpack.decode(data, type=Request)
    except msgspec.MsgspecError as error:
        raise ContractError(f"the body is not a request: {error}") from None


def read_crop(sent: SentCrop, side: int) -> Crop:
    """Decode a crop for an encoder of this side. Raises ContractError."""
    if sent.format == "jpeg":
        return Crop(_decoded(sent.image, side), _mask(sent.mask, side))
    if len(sent.image) != 4 * side * side:
        problem = f"rgba8 of {len(sent.image)} bytes; {side} x {side} has {4 * side * side}"
        raise ContractError(f"{problem}; cut at the side that /v1/identity gives")
    if sent.mask is not None:
        raise ContractError("rgba8 has its mask as alpha; leave `mask` out")
    pixels = np.frombuffer(sent.image, np.uint8).reshape(side, side, 4)
    return Crop(pixels[..., :3], pixels[..., 3])


def write_result(match: RemoteMatch) -> Result:
    """Return the result for one crop."""
    return Result(list(match.evidence.beliefs), match.embedding.astype("<f4").tobytes())


def read_identity(data: bytes) -> Identity:
    """Read a recogniser's identity. Raises ContractError."""
    try:
        identity = msgspec.json.decode(data, type=Identity)
    except (msgspec.MsgspecError, UnicodeDecodeError) as error:
        raise ContractError(f"its identity cannot be read: {error}") from None
    if identity.contract != CONTRACT:
        raise ContractError(f"it uses contract {identity.contract}, this service {CONTRACT}")
    return identity


def read_answer(data: bytes, identity: Identity, count: int) -> tuple[Answer, list[RemoteMatch]]:
    """Read the answer to `count` crops of the recogniser with this identity.

    Raises ContractError if any part of it is wrong.
    """
    try:
        answer = msgspec.msgpack.decode(data, type=Answer)
    except msgspec.MsgspecError as error:
        raise ContractError(f"its answer cannot be read: {error}") from None
    if (answer.gallery, answer.hash) != (identity.gallery, identity.hash):
        sender = f"`{answer.gallery[:64]}` {answer.hash[:64]}"
        raise ContractError(f"answered by {sender}, not `{identity.gallery}` {identity.hash}")
    if len(answer.results) != count:
        raise ContractError(f"{len(answer.results)} results for {count} crops")
    return answer, [_match(result, identity) for result in answer.results]


def _match(result: Result, identity: Identity) -> RemoteMatch:
    beliefs = dict(result.beliefs)
    values = np.array(list(beliefs.values()), np.float64)
    fits = bool((values >= 0.0).all()) and values.sum() <= 1.0 + SUM_ERROR
    if (
        not fits
        or len(beliefs) != len(result.beliefs)
        or not beliefs.keys() <= {*identity.materials, LIVING}
    ):
        raise ContractError("its beliefs are not probabilities of materials of its gallery")
    if len(result.embedding) != 4 * identity.dimension:
        raise ContractError(
            f"an embedding of {len(result.embedding)} bytes, not {4 * identity.dimension}"
        )
    embedding = np.frombuffer(result.embedding, "<f4").astype(np.float32)
    # Every number from another machine is checked, because it is used as if this process had
    # computed it: beliefs decide what is felt, and embeddings become references. NaN fails every
    # comparison, so each condition is written to pass only for right values.
    if not abs(float(np.linalg.norm(embedding)) - 1.0) <= UNIT_ERROR:
        raise ContractError("its embedding is not of unit norm")
    ranked = sorted(beliefs.items(), key=lambda item: -item[1])
    return RemoteMatch(Evidence("encoder", tuple(ranked)), embedding)


def _rgba(crop: Crop) -> SentCrop:
    alpha = np.where(crop.mask > 0, 255, 0).astype(np.uint8)
    return SentCrop("rgba8", np.dstack([crop.image, alpha]).tobytes())


def _decoded(data: bytes, side: int) -> NDArray[np.uint8]:
    frame = Frame(
        id=1,
        captured_at=0.0,
        format="jpeg",
        width=side,
        height=side,
        origin="top",
        image=data,
        region=WHOLE,
    )
    try:
        return pictures.crop(frame, side).image
    except PictureError as error:
        raise ContractError(str(error)) from None


def _mask(bits: bytes | None, side: int) -> NDArray[np.uint8]:
    if bits is None:
        return pictures.central_mask(side)
    if len(bits) != (side * side + 7) // 8:
        raise ContractError(f"a mask of {len(bits)} bytes; {side} x {side} needs a bit per pixel")
    inside = np.unpackbits(np.frombuffer(bits, np.uint8), count=side * side)
    return (inside * 255).astype(np.uint8).reshape(side, side)
