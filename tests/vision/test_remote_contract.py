"""The contract of a shared recogniser: what is written is read, whatever else is refused."""

from dataclasses import replace

import msgspec
import numpy as np
import pytest
import simplejpeg
from each_case import each_row

from hapticvlm.evidence.ladder import Evidence
from hapticvlm.vision.encoders.encoder import DEFAULT, SHIPPED
from hapticvlm.vision.encoders.onnx_encoder import load_onnx_encoder
from hapticvlm.vision.galleries.storage import load_gallery
from hapticvlm.vision.pictures import Crop, central_mask
from hapticvlm.vision.remote import contract
from hapticvlm.vision.remote.contract import Answer, ContractError, Identity, RemoteMatch, SentCrop
from hapticvlm_recogniser_app.replies import identify

SIDE = 32
IDENTITY = Identity(1, "hapticvlm", "tiny", "arcade", "0123", SIDE, 4, ["wood", "glass"])


def crop(seed: int = 0, side: int = SIDE) -> Crop:
    smooth = np.linspace(0, 200, side * side * 3).reshape(side, side, 3) + seed
    return Crop(smooth.astype(np.uint8), central_mask(side))


def found(*beliefs: tuple[str, float]) -> RemoteMatch:
    return RemoteMatch(Evidence("encoder", beliefs), np.array([0, 1, 0, 0], np.float32))


def answer(*results: contract.Result, gallery: str = "arcade", hash: str = "0123") -> bytes:
    return msgspec.msgpack.encode(Answer(gallery, hash, list(results)))


def jpeg(crop: Crop) -> SentCrop:
    image = np.ascontiguousarray(crop.image)
    data = simplejpeg.encode_jpeg(image, quality=90, colorsubsampling="444")
    return SentCrop("jpeg", data, np.packbits(crop.mask > 0).tobytes())


def test_rgba_crops_arrive_bit_for_bit_with_their_masks() -> None:
    data = contract.write_request([crop(), crop(9)], "arcade", wait_ms=150.0)
    request = contract.read_request(data)
    assert (request.gallery, request.wait_ms, len(request.crops)) == ("arcade", 150.0, 2)
    for sent, wanted in zip(request.crops, (crop(), crop(9)), strict=True):
        read = contract.read_crop(sent, SIDE)
        assert np.array_equal(read.image, wanted.image)
        assert np.array_equal(read.mask, wanted.mask)


def test_jpeg_crops_are_smaller_and_keep_their_mask_exactly() -> None:
    sent = jpeg(crop(side=128))
    read = contract.read_crop(sent, 128)
    assert len(sent.image) < 128 * 128 * 4 / 3
    assert np.array_equal(read.mask, central_mask(128))
    assert np.abs(read.image.astype(int) - crop(side=128).image).mean() < 6


def test_a_jpeg_without_a_mask_counts_its_central_disc() -> None:
    sent = SentCrop("jpeg", jpeg(crop()).image)
    assert np.array_equal(contract.read_crop(sent, SIDE).mask, central_mask(SIDE))


@pytest.mark.parametrize(
    ("sent", "said"),
    [
        (SentCrop("rgba8", b"\0" * 12), "cut at the side"),
        (SentCrop("rgba8", b"\0" * SIDE * SIDE * 4, b"\0"), "leave `mask` out"),
        (SentCrop("jpeg", b"GIF89a"), "not a JPEG"),
        (SentCrop("jpeg", b""), "not a JPEG"),
    ],
)
def test_broken_crops_are_refused_with_a_reason(sent: SentCrop, said: str) -> None:
    with pytest.raises(ContractError, match=said):
        contract.read_crop(sent, SIDE)


def test_a_jpeg_of_another_size_or_mask_is_refused() -> None:
    image = jpeg(crop(side=64))
    with pytest.raises(ContractError, match="64 x 64"):
        contract.read_crop(image, SIDE)
    with pytest.raises(ContractError, match="mask of 1 bytes"):
        contract.read_crop(SentCrop("jpeg", image.image, b"\0"), 64)


@pytest.mark.parametrize(
    "body",
    [
        {"crops": []},
        {"crops": [{"format": "png", "image": b""}]},
        {"crops": [{"format": "rgba8", "image": b""}], "gallery": "../secret"},
        {"crops": [{"format": "rgba8", "image": b""}], "wait_ms": 0.0},
        {"crops": [{"format": "rgba8", "image": b""}], "more": 1},
        {"crops": [{"format": "rgba8", "image": b""}] * (contract.MAX_CROPS + 1)},
        7,
    ],
)
def test_broken_requests_are_refused(body: object) -> None:
    with pytest.raises(ContractError):
        contract.read_request(msgspec.msgpack.encode(body))


def test_an_answer_is_read_with_evidence_best_first_and_embedding() -> None:
    result = contract.write_result(found(("glass", 0.2), ("wood", 0.7)))
    _, (read,) = contract.read_answer(answer(result), IDENTITY, 1)
    assert read.evidence.beliefs == (("wood", 0.7), ("glass", 0.2))
    assert read.embedding.tolist() == [0, 1, 0, 0]


GOOD = contract.write_result(found(("wood", 0.7)))


@each_row(
    ("data", "said"),
    [
        (b"<html>", "cannot be read"),
        (answer(GOOD, gallery="other"), "answered by"),
        (answer(GOOD, hash="9999"), "answered by"),
        (answer(), "0 results"),
        (answer(contract.write_result(found(("unobtainium", 0.7)))), "beliefs"),
        (answer(contract.write_result(found(("wood", float("nan"))))), "beliefs"),
        (answer(contract.write_result(found(("wood", float("inf"))))), "beliefs"),
        (answer(contract.write_result(found(("wood", -0.1), ("glass", 0.9)))), "beliefs"),
        (answer(contract.write_result(found(("wood", 0.9), ("glass", 0.9)))), "beliefs"),
        (answer(contract.Result([("wood", 0.7)], b"\0" * 16)), "unit norm"),
        (answer(contract.Result([("wood", 0.7)], b"\0" * 15)), "15 bytes"),
    ],
)
def test_an_answer_counts_only_if_all_of_it_is_right(data: bytes, said: str) -> None:
    with pytest.raises(ContractError, match=said):
        contract.read_answer(data, IDENTITY, 1)


def test_a_newer_contract_and_a_broken_identity_are_refused() -> None:
    newer = msgspec.json.encode(msgspec.structs.replace(IDENTITY, contract=2))
    with pytest.raises(ContractError, match="contract 2"):
        contract.read_identity(newer)
    with pytest.raises(ContractError, match="identity"):
        contract.read_identity(b"\xff")
    assert contract.read_identity(msgspec.json.encode(IDENTITY)) == IDENTITY


@pytest.mark.parametrize(
    "given",
    [
        {"encoder": "e" * (contract.MAX_NAME + 1)},
        {"service": "s" * 3_000_000},
        {"materials": ["m" * (contract.MAX_NAME + 1)]},
        {"materials": ["m"] * (contract.MAX_MATERIALS + 1)},
    ],
)
def test_an_identity_of_endless_names_is_refused(given: dict[str, object]) -> None:
    endless = msgspec.json.encode(msgspec.structs.asdict(IDENTITY) | given)
    with pytest.raises(ContractError, match="identity"):
        contract.read_identity(endless)


def test_the_hash_depends_on_gallery_and_encoder_but_not_on_their_names() -> None:
    encoder = load_onnx_encoder(SHIPPED / DEFAULT)
    gallery = load_gallery(encoder=encoder)
    shipped = identify(encoder, gallery, "shipped")
    assert identify(encoder, load_gallery(encoder=encoder), "other").hash == shipped.hash
    shifted = replace(gallery, calibration=replace(gallery.calibration, threshold=0.9))
    assert identify(encoder, shifted, "shipped").hash != shipped.hash
    assert identify(replace(encoder, revision="x"), gallery, "shipped").hash != shipped.hash
