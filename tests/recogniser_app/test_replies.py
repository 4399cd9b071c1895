"""What a replica makes of a request, without HTTP and without Ray."""

import msgspec
import numpy as np
import pytest

from hapticvlm.vision.loading import load_encoder
from hapticvlm.vision.pictures import Crop, central_mask
from hapticvlm.vision.remote import contract
from hapticvlm_recogniser_app import replies
from hapticvlm_recogniser_app.replies import Embedded, Refusal, load_galleries


@pytest.fixture(scope="module")
def encoder():
    return load_encoder()


@pytest.fixture(scope="module")
def galleries(encoder):
    return load_galleries({}, encoder)


def crops(count, side):
    rng = np.random.default_rng(3)
    return [
        Crop(rng.integers(0, 255, (side, side, 3), np.uint8), central_mask(side))
        for _ in range(count)
    ]


def body(encoder, count=1, **given):
    return contract.write_request(crops(count, encoder.side), **{"wait_ms": 100.0, **given})


def test_an_answer_holds_what_the_gallery_says_of_each_crop_in_order(encoder, galleries):
    job = replies.read_job(body(encoder, 3), galleries, now=10.0)
    assert job.until == pytest.approx(10.1)
    embeddings = encoder.embed(job.crops)
    embedded = [Embedded(row, 3, 1.0, 2.0) for row in embeddings]
    identity = job.named.identity
    answer, found = contract.read_answer(replies.write_answer(job, embedded), identity, 3)
    for one, row in zip(found, embeddings, strict=True):
        assert one.evidence == job.named.gallery.match(row)
        assert np.array_equal(one.embedding, row)
    assert (answer.batch, answer.stages_ms) == (3, {"queue": 1.0, "encode": 2.0})


def test_a_shared_recogniser_believes_flat_pictures_as_little_as_the_service(encoder, galleries):
    side = encoder.side
    flat = Crop(np.full((side, side, 3), (150, 90, 40), np.uint8), central_mask(side))
    job = replies.read_job(contract.write_request([flat], wait_ms=100.0), galleries, now=10.0)
    (row,) = encoder.embed([flat])
    answer = replies.write_answer(job, [Embedded(row, 1, 1.0, 2.0)])
    _, (found,) = contract.read_answer(answer, job.named.identity, 1)
    gallery = job.named.gallery
    assert found.evidence == gallery.match(row, is_flat=True) != gallery.match(row)


def test_a_shared_recogniser_says_what_is_alive(encoder, galleries):
    job = replies.read_job(body(encoder), galleries, now=10.0)
    (row,) = encoder.embed(job.crops)
    answer = replies.write_answer(job, [Embedded(row, 1, 1.0, 2.0, alive=0.9)])
    _, (found,) = contract.read_answer(answer, job.named.identity, 1)
    assert found.evidence.material == "living"
    assert found.evidence.confidence == pytest.approx(0.9)


def test_what_nobody_waits_for_is_not_answered(encoder, galleries):
    job = replies.read_job(body(encoder), galleries, now=0.0)
    with pytest.raises(Refusal) as caught:
        replies.write_answer(job, [None])
    assert caught.value.status == 504


def test_the_gallery_is_the_one_asked_for_or_none(encoder, galleries):
    with pytest.raises(Refusal) as caught:
        replies.read_job(body(encoder, gallery="arcade"), galleries, now=0.0)
    assert caught.value.status == 404
    assert "shipped" not in str(caught.value)


@pytest.mark.parametrize("data", [b"", b"\xc1", msgspec.msgpack.encode({"crops": []})])
def test_what_is_no_request_is_the_callers_fault(galleries, data):
    with pytest.raises(Refusal) as caught:
        replies.read_job(data, galleries, now=0.0)
    assert caught.value.status == 422
