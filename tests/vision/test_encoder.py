"""The shipped encoder, whichever it is, and how encoders are found by name."""

from pathlib import Path

import numpy as np
import pytest
from matplotlib.cbook import get_sample_data
from numpy.typing import NDArray
from PIL import Image
from tiny_encoders import write_onnx

from hapticvlm.evidence.ladder import KNOWN, SURE, Evidence, decide
from hapticvlm.vision.encoders import encoder as encoders
from hapticvlm.vision.encoders import living, onnx_encoder
from hapticvlm.vision.encoders.encoder import EncoderError
from hapticvlm.vision.galleries.storage import load_gallery
from hapticvlm.vision.loading import load_encoder
from hapticvlm.vision.picture_recogniser import recognise
from hapticvlm.vision.pictures import Crop, central_mask


@pytest.fixture(scope="module")
def shipped() -> encoders.Encoder:
    return load_encoder()


def blank(kind: str, side: int) -> NDArray[np.uint8]:
    levels = {"black": 0, "white": 255, "grey": 127}
    if kind == "noise":
        return np.random.default_rng(3).integers(0, 255, (side, side, 3), np.uint8)
    return np.full((side, side, 3), levels[kind], np.uint8)


def test_a_face_is_alive_and_the_same_face_as_a_mosaic_is_not() -> None:
    photograph = np.asarray(Image.open(get_sample_data("grace_hopper.jpg", asfileobj=False)))[
        60:420, 120:420
    ]
    face = recognise(photograph)
    assert (face.material, face.felt_as, next(iter(face.beliefs))) == ("unknown", None, "living")
    mosaic = recognise(photograph[::40, ::40].repeat(40, axis=0).repeat(40, axis=1))
    assert mosaic.beliefs.get("living", 0.0) < 0.1


def test_noise_is_not_alive() -> None:
    noise = np.random.default_rng(3)
    for height, width in ((480, 640), (300, 300), (200, 900)):
        pictures = (
            noise.integers(0, 256, (height, width, 3), np.uint8),
            noise.normal(128, 40, (height, width, 3)).clip(0, 255).astype(np.uint8),
        )
        assert [recognise(picture).beliefs.get("living", 0.0) for picture in pictures] == [0.0, 0.0]


def test_only_animals_that_do_not_look_like_matter_are_counted_and_nothing_else_is_alive() -> None:
    classes = np.zeros((6, 1000), np.float32)
    classes[0, [251, 281]] = 0.45  # a dalmatian, a tabby cat
    classes[1, 5] = 0.9  # an electric ray, which gravel looks like
    classes[2, 423] = 0.9  # a barber's chair
    classes[3, 903] = 0.9  # a wig
    classes[4, [617, 834]] = 0.1  # a lab coat and a suit, which people wear in pictures
    classes[5, [608, 610]] = 0.45  # jeans and a T-shirt, which also lie in drawers
    found = [1.0, 0.0, 0.0, 1.0, 1.0, 0.0]
    assert living.belief(classes, [False] * 6) == pytest.approx(found)
    found[4] = 0.0  # a scene's own outline makes a suit a thing
    assert living.belief(classes, [True] * 6) == pytest.approx(found)


def test_a_sure_material_is_not_alive() -> None:
    statue = Evidence("encoder", (("stone", SURE),))
    assert living.with_living(statue, 1.0) == statue


@pytest.mark.parametrize("kind", ["black", "white", "grey", "noise"])
def test_a_blank_frame_is_unknown(shipped: encoders.Encoder, kind: str) -> None:
    gallery = load_gallery(encoder=shipped)
    seen = Crop(blank(kind, shipped.side), central_mask(shipped.side))
    evidence = gallery.match(shipped.embed([seen])[0])
    assert evidence.confidence < KNOWN
    assert decide([evidence]).source == "unknown"


def test_what_ships_stays_small() -> None:
    files = [path for path in encoders.SHIPPED.rglob("*") if path.is_file()]
    assert sum(path.stat().st_size for path in files) <= 8_000_000


def test_an_encoder_in_the_shipped_folder_is_found_by_its_short_and_its_full_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_onnx(tmp_path / "shipped" / encoders.DEFAULT)
    monkeypatch.setattr(onnx_encoder, "SHIPPED", tmp_path / "shipped")
    assert load_encoder().name == "tiny-1"
    assert load_encoder("tiny-1").dimension == load_encoder(encoders.DEFAULT).dimension == 128


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        ({"device": "cuda"}, "leave --encoder-device out"),
        ({"device": "tpu"}, "`tpu`.*cpu, cuda, auto"),
        ({"threads": 0}, "1 or more"),
    ],
)
def test_options_that_do_not_fit_are_refused(options: dict[str, object], complaint: str) -> None:
    with pytest.raises(EncoderError, match=complaint):
        load_encoder(**options)  # type: ignore[arg-type]
    assert load_encoder(device="auto").name == load_encoder().name


@pytest.mark.torch
def test_a_name_of_the_hub_is_not_a_folder_and_needs_a_connection(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    from huggingface_hub import constants

    monkeypatch.setattr(constants, "HF_HUB_OFFLINE", True)
    with pytest.raises(
        EncoderError, match=r"facebook/convnext-tiny-224.*cannot be downloaded.*give"
    ):
        load_encoder("facebook/convnext-tiny-224")


@pytest.mark.parametrize(
    ("make", "complaint"),
    [
        ((), "is not a folder"),
        (("here/",), "has no config.json"),
        (("here",), "is a JSON file, not a network"),
        (("here/a/config.json", "here/b/encoder.json"), "give one of a, b"),
    ],
)
def test_a_path_without_an_encoder_is_refused_with_what_to_give(
    tmp_path: Path, make: tuple[str, ...], complaint: str
) -> None:
    for name in make:
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.mkdir() if name.endswith("/") else path.write_text("{}")
    with pytest.raises(EncoderError, match=complaint) as caught:
        load_encoder(str(tmp_path / "here"))
    assert "\n" not in str(caught.value)
