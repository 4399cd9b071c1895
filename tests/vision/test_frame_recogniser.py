"""One frame, or several regions of it, to evidence; a failing encoder is no evidence."""

from dataclasses import replace

import msgspec
import numpy as np
import pytest
import simplejpeg
from tiny_encoders import picture, write_onnx

from hapticvlm.evidence.ladder import Evidence
from hapticvlm.messages import Frame, Region
from hapticvlm.vision.encoders.encoder import Encoder
from hapticvlm.vision.frame_recogniser import FrameRecogniser, _digest
from hapticvlm.vision.galleries.gallery import Calibration, Gallery
from hapticvlm.vision.loading import load_encoder
from hapticvlm.vision.pictures import Crop
from hapticvlm.vision.recognition import SceneContext

REGIONS = [Region(x=x, y=y, w=0.25, h=0.25) for y in (0.0, 0.4, 0.7) for x in (0.1, 0.6)]


@pytest.fixture(scope="module")
def encoder(tmp_path_factory: pytest.TempPathFactory) -> Encoder:
    return load_encoder(str(write_onnx(tmp_path_factory.mktemp("onnx") / "tiny")))


@pytest.fixture(scope="module")
def gallery(encoder: Encoder) -> Gallery:
    plain = [np.full((32, 32, 3), colour, np.uint8) for colour in ((200, 40, 40), (40, 40, 200))]
    full = np.full((32, 32), 255, np.uint8)
    references = encoder.embed([Crop(image, full) for image in plain])
    calibration = Calibration(sharpness=8.0, slope=8.0, threshold=0.5)
    return Gallery(encoder.name, ("wood", "metal"), references, np.arange(2), calibration)


def frame(seed: int = 1, side: int = 256, **fields: object) -> Frame:
    given = {"id": 1, "captured_at": 0.0, "format": "jpeg", "origin": "top"}
    image = simplejpeg.encode_jpeg(picture(seed, side), quality=90)
    sized = {"width": side, "height": side, "image": image}
    return Frame(**{**given, **sized, **fields})


def recognise(recogniser: FrameRecogniser, shown: Frame, *, force: bool = True):
    found = recogniser.recognise(shown, "cup", 0.0, force=force)
    assert min(found.stages_ms.values()) >= 0.0, "ms that each stage took"
    return found


def counted_decodes(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Return a list that grows by one with every JPEG that is decoded."""
    decoded: list[int] = []
    decode = simplejpeg.decode_jpeg
    monkeypatch.setattr(
        simplejpeg,
        "decode_jpeg",
        lambda *a, **k: decoded.append(1) or decode(*a, **k),  # type: ignore[func-returns-value]
    )
    return decoded


def beliefs(evidence: Evidence) -> list[float]:
    return [belief for _, belief in evidence.beliefs]


def test_a_region_alone_is_believed_less_than_an_outline_but_the_order_stays(
    encoder: Encoder, gallery: Gallery
) -> None:
    recogniser, shown = FrameRecogniser(encoder, gallery), frame()
    whole = msgspec.structs.replace(shown, region=Region(x=0.0, y=0.0, w=1.0, h=1.0))
    nearly = msgspec.structs.replace(shown, region=Region(x=0.0, y=0.0, w=0.999, h=1.0))
    full, spot = (recognise(recogniser, each).evidence for each in (whole, nearly))
    assert spot.material == full.material
    powers = np.array([*beliefs(full), 1.0 - sum(beliefs(full))]) ** 0.77
    assert np.allclose(beliefs(spot), powers[:-1] / powers.sum(), atol=1e-4)
    assert spot.confidence < full.confidence - 0.01


def test_regions_compared_together_give_the_same_as_one_by_one(
    encoder: Encoder, gallery: Gallery
) -> None:
    recogniser, shown = FrameRecogniser(encoder, gallery), frame()
    together = recogniser.compare(shown, [*REGIONS, None])
    singles = [
        recognise(recogniser, msgspec.structs.replace(shown, region=region))
        for region in [*REGIONS, None]
    ]
    assert len({evidence.beliefs for evidence in together}) > 1
    for one, other in zip(together, singles, strict=True):
        assert one.material == other.evidence.material
        assert np.allclose(beliefs(one), beliefs(other.evidence))


def test_a_picture_of_flat_colours_is_believed_less_wherever_it_is_recognised(
    encoder: Encoder, gallery: Gallery
) -> None:
    humble = replace(gallery, calibration=replace(gallery.calibration, scale=1.0, flat=0.05))
    plain = replace(humble, calibration=replace(humble.calibration, flat=1.0))
    red = np.full((256, 256, 3), (150, 60, 90), np.uint8)
    for image, differs in ((red, True), (picture(1, 256), False)):
        shown = frame(image=simplejpeg.encode_jpeg(image, quality=95))
        answers = []
        for each in (plain, humble):
            recogniser = FrameRecogniser(encoder, each)
            alone = recognise(recogniser, shown).evidence
            (together,) = recogniser.compare(shown, [None])
            assert np.allclose(beliefs(alone), beliefs(together))
            answers.append(alone.confidence)
        assert (answers[1] < answers[0] - 0.02) == differs


def test_whatever_a_crop_depends_on_makes_it_another_picture():
    base = frame(mask=b"m", region=REGIONS[0])
    others = (
        {"format": "png"},
        {"width": 33},
        {"height": 33},
        {"origin": "bottom"},
        {"region": None},
        {"mask": None},
        {"image": b"other"},
    )
    changed = {_digest(msgspec.structs.replace(base, **each)) for each in others}
    assert len(changed | {_digest(base)}) == 1 + len(others)


def test_the_very_same_bytes_of_an_object_are_skipped_without_decoding_them(
    encoder: Encoder, gallery: Gallery, monkeypatch: pytest.MonkeyPatch
) -> None:
    decoded = counted_decodes(monkeypatch)
    recogniser = FrameRecogniser(encoder, gallery)
    assert recognise(recogniser, frame(), force=False).evidence is not None
    assert recognise(recogniser, frame(), force=False).evidence is None
    assert len(decoded) == 1
    assert recognise(recogniser, frame(region=REGIONS[0]), force=False).evidence is not None
    assert recognise(recogniser, frame(seed=2), force=False).evidence is not None
    assert recognise(recogniser, frame(), force=False).evidence is not None  # another lay between
    assert recognise(recogniser, frame(), force=True).evidence is not None
    assert recognise(recogniser, frame(purpose="enrol"), force=False).evidence is not None
    assert len(decoded) == 6


def test_the_last_pictures_of_1024_objects_are_remembered_and_no_more(
    encoder: Encoder, gallery: Gallery
) -> None:
    recogniser, shown = FrameRecogniser(encoder, gallery), frame(side=32)

    def is_recognised(subject: int) -> bool:
        return recogniser.recognise(shown, str(subject), 0.0, force=False).evidence is not None

    assert all(is_recognised(subject) for subject in range(1024))
    assert not is_recognised(0)
    assert is_recognised(1024), "an object more"
    assert not is_recognised(1), "all but the oldest are remembered"
    assert is_recognised(0), "the oldest is forgotten"


def test_the_references_of_16_scenes_are_remembered_and_no_more(
    encoder: Encoder, gallery: Gallery
) -> None:
    recogniser, shown = FrameRecogniser(encoder, gallery), frame(seed=5)
    (plain,) = recogniser.compare(shown, [None])

    def look(scene: str) -> Evidence:
        context = SceneContext(scene, "thing")
        found = recogniser.recognise(shown, "thing", 0.0, force=True, shown=context).evidence
        assert found is not None
        return found

    for seed, material in ((3, "wood"), (4, "metal")):
        named = SceneContext("first", material, material)
        found = recogniser.recognise(frame(seed=seed), material, 0.0, force=True, shown=named)
        assert found.evidence is not None
    for number in range(15):
        look(str(number))
    assert look("first") != plain, "its named objects teach about the thing"
    for number in range(16):
        look(str(number))
    assert look("first") == plain, "a scene more, and the least recent is forgotten"


def test_the_warm_up_picture_does_not_hide_the_first_one(
    encoder: Encoder, gallery: Gallery
) -> None:
    recogniser = FrameRecogniser(encoder, gallery)
    recogniser.warm_up()
    grey = simplejpeg.encode_jpeg(np.full((64, 64, 3), 127, np.uint8))
    shown = frame(width=64, height=64, image=grey)
    assert recogniser.recognise(shown, "", 0.0, force=False).evidence is not None
    assert recogniser.recognise(shown, "", 0.0, force=False).evidence is None


def test_an_encoder_that_fails_is_our_fault_and_a_damaged_picture_is_not(
    encoder: Encoder, gallery: Gallery
) -> None:
    """The tiny encoder has no direction for black."""
    black = simplejpeg.encode_jpeg(np.zeros((64, 64, 3), np.uint8))
    found = recognise(FrameRecogniser(encoder, gallery), frame(width=64, height=64, image=black))
    assert found.evidence is None
    assert found.is_our_fault
    assert "not of unit norm" in found.error
    damaged = recognise(FrameRecogniser(encoder, gallery), frame(image=b"no picture"))
    assert (damaged.is_our_fault, damaged.error_path) == (False, "$.image")
