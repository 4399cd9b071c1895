"""Texture maps are read by six windows, and an atlas of several materials is not taken for one."""

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn, cast

import msgspec
import numpy as np
import pytest
from drawn_textures import SIDE, frame_of, planks, weave
from msgspec.structs import replace

from hapticvlm.evidence.ladder import Evidence
from hapticvlm.messages import Region
from hapticvlm.vision import texture_verdicts, textures
from hapticvlm.vision.encoders.encoder import Encoder, EncoderError
from hapticvlm.vision.frame_recogniser import FrameRecogniser
from hapticvlm.vision.galleries.gallery import Gallery
from hapticvlm.vision.galleries.storage import load_gallery
from hapticvlm.vision.loading import load_encoder
from hapticvlm.vision.pictures import PictureError, Pixels
from hapticvlm.vision.texture_verdicts import TextureVerdicts


@pytest.fixture(scope="module")
def encoder() -> Encoder:
    return load_encoder(None)


@pytest.fixture(scope="module")
def gallery(encoder: Encoder) -> Gallery:
    return load_gallery(encoder=encoder)


def atlas() -> Pixels:
    """Lay out planks, weave and two plain colours with noise in one map."""
    dice = np.random.default_rng(6)
    half = SIDE // 2
    red = np.clip(np.array([190, 30, 30]) + dice.normal(0, 3, (half, half, 3)), 0, 255)
    leaves = np.clip(np.array([60, 140, 50]) + dice.normal(0, 40, (half, half, 3)), 0, 255)
    top = np.hstack([planks(half), weave(half)])
    return np.vstack([top, np.hstack([red, leaves]).astype(np.uint8)])


def best(evidence: Evidence) -> tuple[str | None, float]:
    return evidence.material, evidence.confidence


def test_a_drawn_map_of_boards_is_wood_and_one_of_cloth_is_fabric(
    encoder: Encoder, gallery: Gallery
) -> None:
    wood = textures.read(frame_of(planks()), encoder, gallery)
    cloth = textures.read(frame_of(weave()), encoder, gallery)
    assert wood.rung == cloth.rung == "texture"
    assert wood.material == "wood"
    assert cloth.material == "fabric"


class Fails:
    name, side = "fails", 224

    def embed(self, crops: Sequence[object]) -> NoReturn:
        raise EncoderError(f"no answer to {len(crops)}")


def test_a_frame_that_is_a_map_is_read_as_one_and_an_encoder_that_fails_is_our_fault(
    encoder: Encoder, gallery: Gallery
) -> None:
    read, failed = (
        FrameRecogniser(cast("Encoder", each), gallery).recognise(
            frame_of(planks()), "", 0.0, force=True
        )
        for each in (encoder, Fails())
    )
    assert read.evidence == textures.read(frame_of(planks()), encoder, gallery)
    assert (failed.evidence, failed.error, failed.is_our_fault) == (None, "no answer to 6", True)


def test_an_atlas_is_unsure_and_its_region_is_read_as_what_it_holds(
    encoder: Encoder, gallery: Gallery
) -> None:
    whole = textures.read(frame_of(atlas()), encoder, gallery)
    boards = Region(x=0.0, y=0.0, w=0.5, h=0.5)
    part = textures.read(frame_of(atlas(), boards), encoder, gallery)
    assert whole.confidence < 0.5
    assert part.material == "wood"
    assert part.confidence > whole.confidence


def test_plain_colours_and_too_few_pixels_say_nothing(encoder: Encoder, gallery: Gallery) -> None:
    palette = np.repeat(np.repeat(np.arange(48, dtype=np.uint8).reshape(4, 4, 3) * 5, 32, 0), 32, 1)
    for pixels in (np.full((64, 64, 3), 90, np.uint8), palette, planks()[:7, :7].copy()):
        assert textures.read(frame_of(pixels), encoder, gallery).beliefs == ()


def test_a_gallery_without_a_layer_for_maps_says_nothing_of_them(
    encoder: Encoder, gallery: Gallery
) -> None:
    without = dataclasses.replace(gallery, texture_layer=None)
    assert textures.read(frame_of(planks()), encoder, without).beliefs == ()
    assert texture_verdicts.file_name(encoder, without) is None


@pytest.mark.parametrize("shape", [(1, 4096), (4096, 9), (300, 700)])
def test_maps_of_any_shape_are_cut_into_squares_of_the_encoder(shape: tuple[int, int]) -> None:
    dice = np.random.default_rng(1)
    pixels = dice.integers(0, 256, (*shape, 3), np.uint8)
    crops = textures.windows(frame_of(pixels), 224)
    assert all(crop.image.shape == (224, 224, 3) for crop in crops)
    assert bool(crops) == (min(shape) * min(1.0, SIDE / max(shape)) >= textures.LEAST_PX)


def test_a_region_outside_the_map_is_refused_by_its_field() -> None:
    region = Region(x=1.0, y=0.0, w=0.5, h=1.0)
    with pytest.raises(PictureError) as refused:
        textures.windows(frame_of(planks(), region), 224)
    assert refused.value.path == "$.region"


def test_a_large_map_and_its_small_copy_are_read_alike(encoder: Encoder, gallery: Gallery) -> None:
    large = np.repeat(np.repeat(planks(), 4, axis=0), 4, axis=1)
    small = textures.read(frame_of(planks()), encoder, gallery)
    assert best(textures.read(frame_of(large), encoder, gallery)) == pytest.approx(
        best(small), abs=0.1
    )


def test_what_a_map_showed_is_kept_on_disk_by_its_bytes(
    encoder: Encoder, gallery: Gallery, tmp_path: Path
) -> None:
    name = texture_verdicts.file_name(encoder, gallery)
    assert name is not None
    path = tmp_path / "cache" / name
    first = FrameRecogniser(encoder, gallery, verdicts=TextureVerdicts(path))
    shown = first.read_texture(frame_of(planks()))
    kept = TextureVerdicts(path)
    assert kept.get(texture_verdicts.key_of(frame_of(planks()))) == shown
    region = Region(x=0.0, y=0.0, w=0.5, h=0.5)
    for other in (frame_of(weave()), frame_of(planks(), region)):
        assert kept.get(texture_verdicts.key_of(other)) is None
    renamed = replace(frame_of(planks()), object_id="another", surface=3)
    assert kept.get(texture_verdicts.key_of(renamed)) == shown


def test_a_damaged_or_impossible_file_counts_as_empty_and_is_replaced(tmp_path: Path) -> None:
    path = tmp_path / "verdicts"
    for data in (b"", b"\x81", b"{}" * 99, msgspec.msgpack.encode({"a": [["wood", 1.5]]})):
        path.write_bytes(data)
        verdicts = TextureVerdicts(path)
        assert verdicts.get("a") is None
    verdicts.put("b", Evidence("texture", (("wood", 0.75),)))
    assert TextureVerdicts(path).get("b") == Evidence("texture", (("wood", 0.75),))


def test_the_verdicts_are_bounded_and_the_one_needed_longest_ago_goes() -> None:
    verdicts = TextureVerdicts(None)
    evidence = Evidence("texture", (("wood", 0.75),))
    for number in range(texture_verdicts.MOST):
        verdicts.put(str(number), evidence)
    verdicts.get("0")
    verdicts.put("new", evidence)
    assert verdicts.get("0") == evidence
    assert verdicts.get("1") is None


def test_a_folder_that_cannot_be_written_costs_the_file_and_nothing_else(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    verdicts = TextureVerdicts(tmp_path / "file" / "verdicts")
    evidence = Evidence("texture", (("wood", 0.75),))
    verdicts.put("a", evidence)
    assert verdicts.get("a") == evidence
