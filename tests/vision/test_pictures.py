"""Frames to crops: hostile bytes are refused by name, honest ones come out upright and masked."""

import io
import math
import struct
import zlib

import numpy as np
import pytest
import simplejpeg
from drawn_textures import png
from each_case import each, each_row
from numpy.typing import NDArray
from PIL import Image

from hapticvlm import messages
from hapticvlm.messages import WHOLE
from hapticvlm.vision import tones
from hapticvlm.vision.pictures import (
    MAX_CHUNKS,
    Crop,
    PictureError,
    central_mask,
    check_header,
    crop,
    crops,
    has_changed,
    signature,
)

Pixels = NDArray[np.uint8]


def quadrants(height: int = 448, width: int = 448) -> Pixels:
    """Red, green over blue, white: says which way is up and left."""
    picture = np.zeros((height, width, 3), np.uint8)
    h, w = height // 2, width // 2
    picture[:h, :w] = (255, 0, 0)
    picture[:h, w:] = (0, 255, 0)
    picture[h:, :w] = (0, 0, 255)
    picture[h:, w:] = (255, 255, 255)
    return picture


def weave(seed: int = 0, side: int = 448) -> Pixels:
    """A checked cloth of smooth contrast, as a rendered frame has it."""
    y, x = np.mgrid[0:side, 0:side].astype(float)
    colour = np.random.default_rng(seed).uniform(60, 200, 3)
    relief = 40 * np.sin(x / 9) * np.sin(y / 11) + 30 * (x > side / 2)
    pixels: Pixels = np.clip(colour + relief[..., None], 0, 255).astype(np.uint8)
    return pixels


def jpeg(pixels: Pixels, quality: int = 90) -> bytes:
    data: bytes = simplejpeg.encode_jpeg(np.ascontiguousarray(pixels), quality=quality)
    return data


def frame(
    image: bytes,
    shape: tuple[int, int] = (448, 448),
    format: str = "jpeg",
    *,
    origin: str = "top",
    region: messages.Region | None = None,
    mask: bytes | None = None,
) -> messages.Frame:
    return messages.Frame(
        id=1,
        captured_at=0.0,
        format=format,  # type: ignore[arg-type]
        width=shape[1],
        height=shape[0],
        image=image,
        origin=origin,  # type: ignore[arg-type]
        region=region,
        mask=mask,
    )


def corner(result: Crop, row: int, column: int) -> tuple[int, ...]:
    return tuple(round(float(v) / 255) for v in result.image[row, column])


@pytest.mark.parametrize("format", ["jpeg", "png", "rgb8", "rgba8", "bgra8"])
def test_every_format_is_flipped_when_its_first_row_is_the_bottom(format: str) -> None:
    stored = np.ascontiguousarray(quadrants()[::-1])
    alpha = np.full((448, 448, 1), 7, np.uint8)
    data = {
        "jpeg": jpeg(stored),
        "png": png(stored),
        "rgb8": stored.tobytes(),
        "rgba8": np.dstack([stored, alpha]).tobytes(),
        "bgra8": np.dstack([stored[..., ::-1], alpha]).tobytes(),
    }[format]
    result = crop(frame(data, format=format, origin="bottom", region=WHOLE), 64)
    assert corner(result, 5, 5) == (1, 0, 0)
    assert corner(result, 58, 5) == (0, 0, 1)


def test_region_and_mask_count_from_the_top_left_of_the_upright_frame() -> None:
    mask = np.zeros((448, 448), np.uint8)
    mask[20:200, 20:200] = 1
    stored = np.ascontiguousarray(quadrants()[::-1])
    masked = crop(frame(jpeg(stored), origin="bottom", mask=png(mask)), 64)
    top_left = messages.Region(x=0.05, y=0.05, w=0.4, h=0.4)
    cut = crop(frame(jpeg(stored), origin="bottom", region=top_left), 64)
    assert corner(masked, 32, 32) == corner(cut, 32, 32) == (1, 0, 0)


@pytest.mark.parametrize("points", [[(0, 0), (400, 440)], [(7, 7)]])
def test_a_mask_of_few_pixels_still_marks_something(points: list[tuple[int, int]]) -> None:
    mask = np.zeros((448, 448), np.uint8)
    for point in points:
        mask[point] = 255
    assert crop(frame(jpeg(quadrants()), mask=png(mask)), 32).mask.any()


REGIONS = [
    messages.Region(x=0.0, y=0.0, w=0.3, h=0.3),
    messages.Region(x=0.5, y=0.1, w=0.2, h=0.4),
    messages.Region(x=0.2, y=0.2, w=0.8, h=0.8),
    WHOLE,
    None,
]


@each(masked=[False, True], format=["jpeg", "png", "rgb8"], origin=["top", "bottom"])
def test_regions_cut_together_are_what_they_are_one_by_one(
    origin: str, format: str, masked: bool
) -> None:
    pixels = weave(3)
    data = {"jpeg": jpeg(pixels), "png": png(pixels), "rgb8": pixels.tobytes()}[format]
    mask = np.zeros((448, 448), np.uint8)
    mask[40:300, 20:420] = 255
    given = png(mask) if masked else None
    together = crops(frame(data, format=format, origin=origin, mask=given), REGIONS, 64)
    for region, cut in zip(REGIONS, together, strict=True):
        alone = crop(frame(data, format=format, origin=origin, mask=given, region=region), 64)
        assert (cut.image == alone.image).all()
        assert (cut.mask == alone.mask).all()


def test_regions_cut_together_decode_once_for_each_reduction(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    factors = []
    decode = simplejpeg.decode_jpeg

    def counting(*given: object, **options: object) -> object:
        factors.append(options["min_factor"])
        return decode(*given, **options)

    monkeypatch.setattr(simplejpeg, "decode_jpeg", counting)
    shown = frame(jpeg(weave(3)))
    crops(shown, [REGIONS[0]] * 6, 64)
    assert factors == [2]
    crops(shown, REGIONS, 64)
    assert sorted(factors[1:]) == [1, 2, 4]  # type: ignore[type-var]
    assert crops(shown, [], 64) == []
    assert len(factors) == 4


def test_one_region_outside_the_frame_is_refused_by_field() -> None:
    outside = messages.Region(x=1.0, y=0.0, w=0.5, h=0.5)
    with pytest.raises(PictureError, match=r"\$\.region"):
        crops(frame(jpeg(quadrants())), [WHOLE, outside], 64)


def test_a_mask_is_cut_with_a_margin_that_is_not_object() -> None:
    mask = np.zeros((448, 448), np.uint8)
    mask[100:300, 100:300] = 255
    result = crop(frame(jpeg(quadrants()), mask=png(mask)), 64)
    assert 0.7 < (result.mask > 0).mean() < 0.95
    assert result.mask[0].max() == 0
    assert result.mask[32, 32] == 255


def test_a_mask_counts_only_within_a_given_region() -> None:
    both = png(np.full((448, 448), 255, np.uint8))
    right = messages.Region(x=0.6, y=0.0, w=0.3, h=0.4)
    result = crop(frame(jpeg(quadrants()), region=right, mask=both), 64)
    assert corner(result, 32, 32) == (0, 1, 0)


def test_a_coloured_mask_marks_what_is_not_black() -> None:
    mask = np.zeros((448, 448, 3), np.uint8)
    mask[100:300, 100:300, 2] = 1
    result = crop(frame(jpeg(quadrants()), mask=png(mask)), 64)
    assert result.mask[32, 32] == 255


GREY = 0  # colour types of PNG
PALETTE = 3


def packed(inside: NDArray[np.bool_], bits: int, colour_type: int) -> bytes:
    """Write a mask by hand as a PNG of grey levels, or of the palette black, white, black..."""
    height, width = inside.shape
    shifts = np.arange(bits)[::-1]
    values = np.where(inside, 1, 0)
    rows = np.packbits((values[..., None] >> shifts & 1).reshape(height, -1), axis=1)
    header = struct.pack(">IIBBBBB", width, height, bits, colour_type, 0, 0, 0)
    data = zlib.compress(np.pad(rows, ((0, 0), (1, 0))).tobytes())
    chunks = [(b"IHDR", header), (b"IDAT", data), (b"IEND", b"")]
    colours = (bytes(3) + b"\xff" * 3 + bytes(3 * (2**bits - 2)))[: 3 * 2**bits]
    return _png_of(chunks if colour_type == GREY else [chunks[0], (b"PLTE", colours), *chunks[1:]])


def an_ellipse(height: int = 448, width: int = 448) -> NDArray[np.bool_]:
    y, x = np.mgrid[:height, :width]
    inside: NDArray[np.bool_] = ((x - 150) / 90) ** 2 + ((y - 200) / 130) ** 2 < 1
    return inside


@each(bits=[1, 2, 4, 8], colour_type=[GREY, PALETTE])
def test_a_mask_of_any_depth_marks_what_one_of_eight_bits_marks(
    bits: int, colour_type: int
) -> None:
    inside = an_ellipse(449, 451)  # rows that end within a byte
    image = jpeg(weave(3, 460)[:449, :451])
    expected = crop(
        frame(image, (449, 451), mask=png(np.where(inside, 255, 0).astype(np.uint8))), 64
    )
    result = crop(frame(image, (449, 451), mask=packed(inside, bits, colour_type)), 64)
    assert (result.mask == expected.mask).all()
    assert (result.image == expected.image).all()


def test_a_colour_of_a_palette_marks_what_is_not_black() -> None:
    drawn = Image.fromarray(np.where(an_ellipse(), 1, 2).astype(np.uint8), "P")
    drawn.putpalette([9, 9, 9, 0, 0, 1, 0, 0, 0])  # 1: nearly black, 2: black
    file = io.BytesIO()
    drawn.save(file, "PNG")
    result = crop(frame(jpeg(quadrants()), mask=file.getvalue()), 64)
    expected = crop(frame(jpeg(quadrants()), mask=packed(an_ellipse(), 1, GREY)), 64)
    assert (result.mask == expected.mask).all()


def test_a_picture_of_one_bit_is_black_and_white() -> None:
    result = crop(frame(packed(an_ellipse(), 1, GREY), format="png", region=WHOLE), 448)
    assert (result.image == np.where(an_ellipse(), 255, 0)[..., None]).all()


def test_a_cut_is_what_pillow_makes_of_the_whole_picture() -> None:
    rng = np.random.default_rng(2)
    pixels = weave(5, 500)
    for _ in range(30):
        x, y = rng.uniform(0, 0.6, 2)
        region = messages.Region(x=x, y=y, w=rng.uniform(0.01, 0.6), h=rng.uniform(0.01, 0.6))
        left, top = round(x * 500), round(y * 500)
        right, bottom = (
            min(500, math.ceil((at + length) * 500))
            for at, length in ((x, region.w), (y, region.h))
        )
        whole = Image.fromarray(pixels).resize(
            (64, 64), Image.Resampling.BILINEAR, box=(left, top, right, bottom)
        )
        cut = crop(frame(pixels.tobytes(), (500, 500), "rgb8", region=region), 64)
        difference = np.abs(cut.image.astype(int) - tones.stretched(np.asarray(whole))[0])
        assert difference.max() <= 3  # grey levels, of rounding before the tones are stretched


def test_the_shared_mask_of_the_centre_cannot_be_changed() -> None:
    with pytest.raises(ValueError, match="read-only"):
        central_mask(64)[0, 0] = 255


def test_without_region_and_mask_the_centre_is_cut() -> None:
    picture = np.zeros((448, 448, 3), np.uint8)
    picture[112:336, 112:336] = 255
    result = crop(frame(jpeg(picture, 98)), 64)
    assert result.image[2:-2, 2:-2].min() > 200
    assert np.array_equal(result.mask, central_mask(64))
    assert result.mask[0, 0] == 0
    assert result.mask[32, 32] == 255


def test_the_reduced_decode_agrees_with_the_full_one() -> None:
    picture = weave(3)
    reduced = crop(frame(jpeg(picture), region=WHOLE), 112).image.astype(float)
    full = crop(frame(picture.tobytes(), format="rgb8", region=WHOLE), 112).image.astype(float)
    assert np.abs(reduced - full).mean() < 4.0  # grey levels, JPEG noise included


def test_odd_sizes_and_single_pixels_still_give_the_side() -> None:
    for shape in [(1, 1), (3, 200), (451, 333)]:
        picture = np.full((*shape, 3), 90, np.uint8)
        for side in (64, 128):
            result = crop(frame(jpeg(picture), shape, region=WHOLE), side)
            assert result.image.shape == (side, side, 3)
            assert result.mask.shape == (side, side)


def bomb(width: int, height: int) -> bytes:
    """A PNG whose header promises far more pixels than its bytes hold."""
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return _png_of([(b"IHDR", header), (b"IDAT", zlib.compress(bytes(1000))), (b"IEND", b"")])


def _png_of(chunks: list[tuple[bytes, bytes]]) -> bytes:
    parts = [b"\x89PNG\r\n\x1a\n"]
    for kind, body in chunks:
        parts += [struct.pack(">I", len(body)), kind, body]
        parts.append(struct.pack(">I", zlib.crc32(kind + body)))
    return b"".join(parts)


def _two_headers() -> bytes:
    """A sound PNG of 600 px whose first header claims 448."""
    small = struct.pack(">IIBBBBB", 448, 448, 8, 2, 0, 0, 0)
    large = struct.pack(">IIBBBBB", 600, 600, 8, 2, 0, 0, 0)
    body = zlib.compress(bytes(600 * (1 + 600 * 3)))
    return _png_of([(b"IHDR", small), (b"IHDR", large), (b"IDAT", body), (b"IEND", b"")])


def _chunks(count: int) -> bytes:
    """A sound PNG of 64 px in `count` chunks, most of them empty."""
    header = struct.pack(">IIBBBBB", 64, 64, 8, 2, 0, 0, 0)
    body = zlib.compress(bytes(64 * (1 + 64 * 3)))
    filler = [(b"tEXt", b"")] * (count - 3)
    return _png_of([(b"IHDR", header), *filler, (b"IDAT", body), (b"IEND", b"")])


def test_a_png_of_too_many_chunks_is_refused() -> None:
    assert crop(frame(_chunks(MAX_CHUNKS), (64, 64), "png"), 32).image.shape == (32, 32, 3)
    for beyond in (MAX_CHUNKS + 1, 300_000):  # the latter kept a decoder busy for a second or two
        with pytest.raises(PictureError, match="chunks"):
            check_header(frame(_chunks(beyond), (64, 64), "png"))


def _scans() -> bytes:
    data = jpeg(quadrants())
    return data[:-2] + b"\xff\xda\x00\x02" * 100 + data[-2:]


HOSTILE = {
    "size differs from the JPEG": (frame(jpeg(quadrants()), (448, 449)), "$.image"),
    "no JPEG": (frame(b"GIF89a" + bytes(500)), "$.image"),
    "one byte": (frame(b"\xff"), "$.image"),
    "PNG said to be JPEG": (frame(png(quadrants())), "$.image"),
    "JPEG said to be PNG": (frame(jpeg(quadrants()), format="png"), "$.image"),
    "short PNG": (frame(b"\x89PNG\r\n\x1a\n", format="png"), "$.image"),
    "PNG bomb": (frame(bomb(60000, 60000), format="png"), "$.image"),
    "rgb8 too short": (frame(bytes(448 * 448 * 3 - 1), format="rgb8"), "$.image"),
    "rgba8 as rgb8": (frame(bytes(448 * 448 * 4), format="rgb8"), "$.image"),
    "too wide": (frame(bytes(9), (1, 5000), format="rgb8"), "$.width"),
    "endless chunks in a mask": (
        frame(jpeg(quadrants(64, 64)), (64, 64), mask=_chunks(5000)),
        "$.mask",
    ),
    "mask of another size": (
        frame(jpeg(quadrants()), mask=png(np.ones((64, 64), np.uint8))),
        "$.mask",
    ),
    "mask bomb": (frame(jpeg(quadrants()), mask=bomb(30000, 30000)), "$.mask"),
    "mask is a JPEG": (frame(jpeg(quadrants()), mask=jpeg(quadrants())), "$.mask"),
    "mask of 16 bits": (
        frame(jpeg(quadrants()), mask=png(np.ones((448, 448), np.uint16))),
        "$.mask",
    ),
    "region outside": (
        frame(jpeg(quadrants()), region=messages.Region(x=1.0, y=0.2, w=0.5, h=0.5)),
        "$.region",
    ),
}


@each_row(("bad", "path"), HOSTILE.values())
def test_the_header_is_checked_before_a_pixel_is_decoded(bad: messages.Frame, path: str) -> None:
    with pytest.raises(PictureError) as caught:
        check_header(bad)
    assert caught.value.path == path
    assert str(caught.value).startswith(path)
    assert ";" in str(caught.value) or ":" in str(caught.value)[len(path) + 1 :]


BROKEN = {
    "endless scans": (frame(_scans()), "$.image"),
    "truncated JPEG": (frame(jpeg(weave())[:4000]), "$.image"),
    "truncated PNG": (frame(png(weave())[:2000], format="png"), "$.image"),
    "PNG with two headers": (frame(_two_headers(), format="png"), "$.image"),
    "PNG without pixels": (frame(bomb(448, 448), format="png"), "$.image"),
    "empty mask": (frame(jpeg(weave()), mask=png(np.zeros((448, 448), np.uint8))), "$.mask"),
    "truncated mask": (
        frame(jpeg(weave()), mask=png(weave()[..., 0].copy())[:900]),
        "$.mask",
    ),
}


@pytest.mark.parametrize(("bad", "path"), BROKEN.values(), ids=BROKEN.keys())
def test_a_broken_body_is_refused_by_name(bad: messages.Frame, path: str) -> None:
    with pytest.raises(PictureError) as caught:
        crop(bad, 64)
    assert caught.value.path == path


def restarting(pixels: Pixels) -> bytes:
    """A JPEG with a restart marker after each row of blocks, as webcams write them."""
    out = io.BytesIO()
    Image.fromarray(pixels).save(out, "JPEG", quality=90, restart_marker_rows=1)
    return out.getvalue()


def with_stray_bytes(data: bytes, marker: bytes, count: int) -> bytes:
    """A JPEG with bytes that belong to nothing before the first such marker of its scan."""
    at = data.index(marker, data.index(b"\xff\xda"))
    stray = np.random.default_rng(count).integers(0, 255, count, np.uint8).tobytes()
    return data[:at] + stray + data[at:]


@pytest.mark.parametrize("count", [16, 608])
@pytest.mark.parametrize("marker", [b"\xff\xd0", b"\xff\xd9"], ids=["restart", "end"])
def test_stray_bytes_before_a_marker_change_no_pixel(marker: bytes, count: int) -> None:
    plain = restarting(weave())
    camera = with_stray_bytes(plain, marker, count)
    for side in (64, 448):  # reduced and whole
        expected = crop(frame(plain, region=WHOLE), side)
        assert (crop(frame(camera, region=WHOLE), side).image == expected.image).all()


def test_a_picture_that_is_cut_after_stray_bytes_is_refused() -> None:
    camera = with_stray_bytes(restarting(weave()), b"\xff\xd0", 16)
    for length in (len(camera) // 2, len(camera) - 2):
        with pytest.raises(PictureError, match="broken JPEG"):
            crop(frame(camera[:length], region=WHOLE), 64)


def test_damaged_bytes_never_raise_anything_but_a_picture_error() -> None:
    rng = np.random.default_rng(7)
    originals = [("jpeg", jpeg(weave(side=64))), ("png", png(weave(side=64)))]
    for format, data in originals:
        for _ in range(300):
            damaged = bytearray(data)
            for at in rng.integers(0, len(data), 4):
                damaged[at] = rng.integers(0, 256)
            try:
                result = crop(frame(bytes(damaged), (64, 64), format, region=WHOLE), 32)
                assert result.image.shape == (32, 32, 3)
            except PictureError:
                pass


def test_jpeg_noise_and_a_pixel_of_jitter_are_not_a_change() -> None:
    still = weave(1, 460)
    before = signature(crop(frame(jpeg(still[:448, :448], 90)), 128))
    for quality, dy, dx in [(50, 0, 0), (75, 1, 0), (75, 0, 1), (60, 1, 1)]:
        moved = jpeg(still[dy : dy + 448, dx : dx + 448], quality)
        assert not has_changed(before, signature(crop(frame(moved), 128)))


def test_another_material_a_hand_and_the_dark_are_changes() -> None:
    before = signature(crop(frame(jpeg(weave(1))), 128))
    hand = weave(1)
    hand[150:230, 150:230] = (224, 172, 140)
    dark = np.zeros((448, 448, 3), np.uint8)
    for other in (weave(2), hand, dark):
        assert has_changed(before, signature(crop(frame(jpeg(other)), 128)))


def test_a_faint_spot_in_one_cell_is_a_change() -> None:
    before = signature(crop(frame(jpeg(weave(1))), 128))
    spot = weave(1)
    spot[196:224, 196:224] += 32  # grey levels
    assert has_changed(before, signature(crop(frame(jpeg(spot)), 128)))


def test_a_moved_mask_is_a_change() -> None:
    image = np.full((64, 64, 3), 128, np.uint8)
    left = Crop(image, np.where(np.arange(64) < 32, 255, 0).astype(np.uint8)[None].repeat(64, 0))
    right = Crop(image, np.ascontiguousarray(left.mask[:, ::-1]))
    assert has_changed(signature(left), signature(right))
