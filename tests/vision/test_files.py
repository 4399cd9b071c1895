"""Picture files: photographs as they come are upright 8-bit RGB frames, or are refused in words."""

import io
import subprocess
import sys
from pathlib import Path

import msgspec
import numpy as np
import pytest
from each_case import each
from numpy.typing import NDArray
from PIL import Image
from profiles import profile_with_red_and_green_swapped

from hapticvlm.errors import HapticVLMError
from hapticvlm.messages import MAX_SIDE_PX
from hapticvlm.vision import pictures
from hapticvlm.vision.files import FileError, decode_frame, left_out, list_files, read_frame
from hapticvlm.vision.galleries.enrol import EnrolError, find_pictures

Pixels = NDArray[np.uint8]
WIDTH, HEIGHT = 60, 40
ORIENTATION = 0x0112
CORNERS = {"red": (230, 20, 20), "green": (20, 230, 20), "blue": (20, 20, 230)}


def picture() -> Image.Image:
    """Red top left, green top right, blue bottom left, grey bottom right; not square."""
    pixels = np.full((HEIGHT, WIDTH, 3), 128, np.uint8)
    pixels[: HEIGHT // 2, : WIDTH // 2] = CORNERS["red"]
    pixels[: HEIGHT // 2, WIDTH // 2 :] = CORNERS["green"]
    pixels[HEIGHT // 2 :, : WIDTH // 2] = CORNERS["blue"]
    return Image.fromarray(pixels)


def saved(path: Path, image: Image.Image, **options: object) -> Path:
    image.save(path, **options)  # type: ignore[arg-type]
    return path


def decoded(path: Path, mask: Path | None = None) -> Pixels:
    """The whole frame as the service decodes it: (H, W, 3)."""
    frame = read_frame(path, mask)
    assert (frame.width, frame.height) == (WIDTH, HEIGHT)
    if frame.format == "rgb8":
        return np.frombuffer(frame.image, np.uint8).reshape(HEIGHT, WIDTH, 3)
    return np.asarray(Image.open(io.BytesIO(frame.image)).convert("RGB"))


def is_like(pixels: Pixels, expected: Image.Image, within: float = 12.0) -> bool:
    difference = np.abs(pixels.astype(int) - np.asarray(expected.convert("RGB")).astype(int))
    return float(difference.mean()) < within


def test_a_plain_jpeg_is_handed_on_as_it_is(tmp_path: Path) -> None:
    path = saved(tmp_path / "one.jpg", picture())
    frame = read_frame(path)
    assert (frame.format, frame.image) == ("jpeg", path.read_bytes())


@pytest.mark.parametrize("mode", ["RGB", "L", "CMYK"])
@pytest.mark.parametrize("options", [{"subsampling": 0}, {"subsampling": 2}, {"progressive": True}])
def test_a_jpeg_is_the_same_pixels_by_path_image_and_array_and_refused_alike_when_cut(
    tmp_path: Path, mode: str, options: dict[str, object]
) -> None:
    path = saved(tmp_path / "one.jpg", photograph().convert(mode), **options)
    with Image.open(path) as image:
        ways = (path, image, np.asarray(image.convert("RGB")))
        by_path, *others = (pictures.decode_upright(read_frame(way), 1) for way in ways)
    assert all((pixels == by_path).all() for pixels in others)
    path.write_bytes(path.read_bytes()[:-200])
    with Image.open(path) as image:
        for way in (path, image):
            with pytest.raises(HapticVLMError, match="broken"):
                pictures.decode_upright(read_frame(way), 1)


@pytest.mark.parametrize("turn", range(1, 9))
@pytest.mark.parametrize("suffix", ["jpg", "png", "webp"])
def test_a_photograph_is_turned_upright(tmp_path: Path, turn: int, suffix: str) -> None:
    back = {
        2: Image.Transpose.FLIP_LEFT_RIGHT,
        3: Image.Transpose.ROTATE_180,
        4: Image.Transpose.FLIP_TOP_BOTTOM,
        5: Image.Transpose.TRANSPOSE,
        6: Image.Transpose.ROTATE_90,
        7: Image.Transpose.TRANSVERSE,
        8: Image.Transpose.ROTATE_270,
    }
    stored = picture().transpose(back[turn]) if turn > 1 else picture()
    exif = Image.Exif()
    exif[ORIENTATION] = turn
    path = saved(tmp_path / f"one.{suffix}", stored, exif=exif)
    assert is_like(decoded(path), picture())


def test_exif_that_is_broken_or_absurd_is_passed_over(tmp_path: Path) -> None:
    exif = Image.Exif()
    exif[ORIENTATION] = 99
    path = saved(tmp_path / "one.jpg", picture(), exif=exif)
    assert is_like(decoded(path), picture())
    data = path.read_bytes()
    where = data.index(b"Exif\x00\x00") + 6
    path.write_bytes(data[:where] + b"\xff" * 8 + data[where + 8 :])
    assert is_like(decoded(path), picture())


@pytest.mark.parametrize("mode", ["L", "1", "P", "LA", "RGBA", "CMYK"])
def test_other_ways_to_store_colour_are_read(tmp_path: Path, mode: str) -> None:
    path = tmp_path / ("one.jpg" if mode == "CMYK" else "one.png")
    image = picture().convert(mode)
    image.save(path)
    assert is_like(decoded(path), image, within=20.0)


def test_sixteen_bits_of_grey_are_scaled_not_clipped(tmp_path: Path) -> None:
    levels = np.linspace(0, 65535, WIDTH * HEIGHT).reshape(HEIGHT, WIDTH).astype(np.uint16)
    path = saved(tmp_path / "deep.png", Image.fromarray(levels))
    assert np.abs(decoded(path)[..., 0].astype(int) - (levels >> 8)).max() <= 1


@pytest.mark.parametrize("suffix", ["png", "webp"])
def test_transparent_pixels_get_the_ground_colour(tmp_path: Path, suffix: str) -> None:
    image = picture().convert("RGBA")
    image.putalpha(Image.fromarray(np.repeat([[255] * 30 + [0] * 30], HEIGHT, 0).astype(np.uint8)))
    path = saved(
        tmp_path / f"one.{suffix}", image, **({"lossless": True} if suffix == "webp" else {})
    )
    pixels = decoded(path)
    assert (pixels[:, 30:] == 127).all()
    assert is_like(pixels[:, :30], picture().crop((0, 0, 30, HEIGHT)))


@pytest.mark.parametrize("suffix", ["png", "webp"])
def test_an_animation_is_refused_with_its_length(tmp_path: Path, suffix: str) -> None:
    turned = picture().transpose(Image.Transpose.FLIP_LEFT_RIGHT)
    path = saved(tmp_path / f"one.{suffix}", picture(), save_all=True, append_images=[turned])
    with pytest.raises(FileError, match=r"one\.\w+: .*animation of 2 pictures"):
        read_frame(path)


def test_a_phones_jpeg_with_a_second_picture_is_read(tmp_path: Path) -> None:
    other = Image.new("RGB", (8, 8))
    path = tmp_path / "one.jpg"
    picture().save(path, "MPO", save_all=True, append_images=[other])
    assert is_like(decoded(path), picture())


@pytest.mark.parametrize("turn", [1, 6])
def test_a_cameras_stray_bytes_are_skipped_upright_or_turned(tmp_path: Path, turn: int) -> None:
    exif = Image.Exif()
    exif[ORIENTATION] = turn
    path = saved(tmp_path / "plain.jpg", picture(), exif=exif)
    camera = tmp_path / "camera.jpg"
    data = path.read_bytes()
    camera.write_bytes(data[:-2] + b"stray" * 9 + data[-2:])
    plain = pictures.crop(read_frame(path), 32)
    assert (pictures.crop(read_frame(camera), 32).image == plain.image).all()
    for cut in (data[: -len(data) // 8], data[:-2] + b"stray"):
        camera.write_bytes(cut)
        with pytest.raises((FileError, pictures.PictureError), match="broken"):
            pictures.crop(read_frame(camera), 32)


def test_a_large_picture_is_shrunk_with_its_mask(tmp_path: Path) -> None:
    side = MAX_SIDE_PX + 1000
    pixels = np.zeros((50, side, 3), np.uint8)
    pixels[:, side // 2 :] = 200
    for name in ("large.png", "large.jpg"):
        path = saved(tmp_path / name, Image.fromarray(pixels))
        mask = saved(tmp_path / "mask.png", Image.fromarray(pixels[..., 0]))
        frame = read_frame(path, mask)
        assert max(frame.width, frame.height) == MAX_SIDE_PX
        crop = pictures.crop(frame, 32)
        assert crop.image[crop.mask > 0].mean() == pytest.approx(200, abs=5)


def test_a_file_that_is_no_whole_picture_is_refused_by_name(tmp_path: Path) -> None:
    path = tmp_path / "one.png"
    with pytest.raises(FileError, match=r"one\.png: No such file"):
        read_frame(path)
    others = b"", b"text", b"\xff\xd8\xff", b"\x89PNG\r\n\x1a\n", b"GIF89a" + b"\0" * 20, b"BM" * 40
    for content in others:
        path.write_bytes(content)
        with pytest.raises(FileError, match=r"one\.png: .*JPEG, PNG or WebP"):
            read_frame(path)
    for suffix in ("png", "webp"):
        torn = saved(tmp_path / f"torn.{suffix}", picture())
        torn.write_bytes(torn.read_bytes()[:-40])
        with pytest.raises(FileError, match=rf"torn\.{suffix}: "):
            read_frame(torn)


@pytest.mark.parametrize("side", [10_000, 20_000])
def test_a_picture_that_unfolds_into_gigabytes_is_refused(tmp_path: Path, side: int) -> None:
    path = saved(tmp_path / "bomb.png", Image.new("1", (side, side)))
    with pytest.raises(FileError, match="shrink"):
        read_frame(path)


@pytest.mark.parametrize("mode", ["L", "1", "P", "LA", "RGB", "RGBA", "I;16"])
def test_a_mask_may_be_drawn_in_any_mode(tmp_path: Path, mode: str) -> None:
    inside = np.zeros((HEIGHT, WIDTH), np.uint8)
    inside[:20, :30] = 200
    grey = Image.fromarray(inside)
    drawn = Image.fromarray(inside.astype(np.uint16)) if mode == "I;16" else grey.convert(mode)
    mask = saved(tmp_path / "mask.png", drawn)
    crop = pictures.crop(read_frame(saved(tmp_path / "one.png", picture()), mask), 16)
    assert np.abs(crop.image[crop.mask > 0].mean(axis=0) - CORNERS["red"]).max() < 20


@pytest.mark.parametrize("colour", [(255, 255, 255), (0, 0, 0)], ids=["white", "black"])
@pytest.mark.parametrize("mode", ["RGBA", "LA"])
def test_a_shape_in_the_alpha_is_the_mask_at_both_doors(
    tmp_path: Path, mode: str, colour: tuple[int, int, int]
) -> None:
    alpha = np.zeros((HEIGHT, WIDTH), np.uint8)
    alpha[:20, :30] = 255
    drawn = Image.new("RGB", (WIDTH, HEIGHT), colour)
    drawn.putalpha(Image.fromarray(alpha))
    mask = saved(tmp_path / "mask.png", drawn.convert(mode))
    from_file = read_frame(saved(tmp_path / "one.png", picture()), mask)
    sent = msgspec.structs.replace(from_file, mask=mask.read_bytes())
    for frame in (from_file, sent):
        assert (np.asarray(pictures.decode_mask(frame)) > 0).sum() == 20 * 30


def palette_of(indices: Pixels) -> Image.Image:
    image = Image.fromarray(indices).convert("P")
    image.putpalette([0, 0, 0, 200, 30, 30, 30, 200, 30])
    return image


GROUNDS = {  # of a mask whose object is True
    "ids from 1": lambda inside: Image.fromarray(np.where(inside, 2, 1).astype(np.uint8)),
    "levels of video": lambda inside: Image.fromarray(np.where(inside, 235, 16).astype(np.uint8)),
    "two colours, equally bright": lambda inside: Image.fromarray(
        np.where(inside[..., None], (200, 0, 9), (0, 200, 9)).astype(np.uint8)
    ),
    "two entries of a palette": lambda inside: palette_of(np.where(inside, 1, 2).astype(np.uint8)),
    "wide ids": lambda inside: Image.fromarray(np.where(inside, 700, 300).astype(np.uint16)),
}


@each(ground=list(GROUNDS))
def test_a_ground_that_is_not_black_is_not_the_object(
    ground: str, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.clear()
    inside = np.zeros((HEIGHT, WIDTH), bool)
    inside[5:25, 5:35] = True
    pictures._tell_ground.cache_clear()
    mask = saved(tmp_path / "mask.png", GROUNDS[ground](inside))
    frame = read_frame(saved(tmp_path / "one.png", picture()), mask)
    assert (np.asarray(pictures.decode_mask(frame)) > 0).tolist() == inside.tolist()
    assert "ground" in caplog.text


def test_an_object_in_white_may_fill_its_picture_to_a_soft_corner() -> None:
    levels = np.full((HEIGHT, WIDTH), 255, np.uint8)
    levels[0, :9] = 200
    assert (np.asarray(pictures.mask_levels(Image.fromarray(levels))) > 0).all()


def test_a_mask_is_of_the_upright_picture(tmp_path: Path) -> None:
    exif = Image.Exif()
    exif[ORIENTATION] = 6
    stored = picture().transpose(Image.Transpose.ROTATE_90)
    path = saved(tmp_path / "one.jpg", stored, exif=exif)
    inside = np.zeros((HEIGHT, WIDTH), np.uint8)
    inside[20:, :30] = 255
    upright = saved(tmp_path / "upright.png", Image.fromarray(inside))
    crop = pictures.crop(read_frame(path, upright), 16)
    assert np.abs(crop.image[crop.mask > 0].mean(axis=0) - CORNERS["blue"]).max() < 25
    lying = saved(tmp_path / "lying.png", Image.fromarray(inside.T.copy()))
    with pytest.raises(FileError, match=r"lying\.png: the mask is 40 x 60 px"):
        read_frame(path, lying)


def test_an_empty_mask_is_refused_by_name(tmp_path: Path) -> None:
    path = saved(tmp_path / "one.png", picture())
    mask = saved(tmp_path / "mask.png", Image.new("L", (WIDTH, HEIGHT)))
    with pytest.raises(FileError, match=r"mask\.png: no pixel is nonzero"):
        read_frame(path, mask)


OTHERS = {
    "b.HEIC": b"\0\0\0\x18ftypheic\0\0\0\0",
    "c.heic": b"\0\0\0\x18ftypmif1\0\0\0\0",
    "d.avif": b"\0\0\0\x1cftypavif\0\0\0\0",
    "e.gif": b"GIF89a" + bytes(20),
    "unnamed": b"II*\0" + bytes(20),
    "notes.txt": b"BM is no picture",
    ".hidden.gif": b"GIF89a" + bytes(20),
}


def test_a_folder_looks_at_first_bytes_and_tells_what_it_leaves_out(tmp_path: Path) -> None:
    (tmp_path / "below").mkdir()
    picture().save(tmp_path / "below" / "d.png")
    picture().save(tmp_path / "f", "PNG")
    picture().save(tmp_path / "a.jfif", "JPEG")
    assert left_out(tmp_path) is None
    for name, content in OTHERS.items():
        (tmp_path / name).write_bytes(content)
    assert [path.name for path in list_files(tmp_path)] == ["a.jfif", "f"]
    assert left_out(tmp_path) == "2 HEIC, 1 AVIF, 1 GIF, 1 TIFF"


def test_a_gallery_counts_every_kind_and_warns_of_what_it_leaves_out(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / "wood").mkdir()
    picture().save(tmp_path / "wood/a.jfif", "JPEG")
    picture().save(tmp_path / "wood/b.webp")
    (tmp_path / "wood/c.HEIC").write_bytes(OTHERS["b.HEIC"])
    found = find_pictures(tmp_path, ["wood"])
    assert [one.path.name for one in found] == ["a.jfif", "b.webp"]
    assert "wood: left out: 1 HEIC; save them as JPEG" in caplog.text
    (tmp_path / "glass").mkdir()
    (tmp_path / "glass/c.HEIC").write_bytes(OTHERS["b.HEIC"])
    with pytest.raises(EnrolError, match="holds no JPEG, PNG or WebP but 1 HEIC"):
        find_pictures(tmp_path, ["glass", "wood"])


def photograph(seed: int = 1) -> Image.Image:
    """A picture with something everywhere."""
    noise = np.random.default_rng(seed).integers(60, 220, (90, 160, 3), dtype=np.uint8)
    return Image.fromarray(noise).resize((320, 180), Image.Resampling.BICUBIC)


def barred(colour: tuple[int, int, int], above: int, beside: int = 0) -> Image.Image:
    """The photograph between bars of so many px each."""
    size = (320 + 2 * beside, 180 + 2 * above)
    picture = Image.new("RGB", size, colour)
    picture.paste(photograph(), (beside, above))
    return picture


@pytest.mark.parametrize("suffix", ["png", "jpg"])
@pytest.mark.parametrize(
    ("colour", "above", "beside"),
    [((0, 0, 0), 40, 0), ((0, 0, 0), 0, 60), ((90, 90, 90), 24, 0), ((16, 16, 16), 20, 30)],
)
def test_uniform_bars_are_cut_before_a_picture_is_looked_at(
    tmp_path: Path, suffix: str, colour: tuple[int, int, int], above: int, beside: int
) -> None:
    path = tmp_path / f"barred.{suffix}"
    barred(colour, above, beside).save(path, quality=95)
    frame = read_frame(path)

    assert abs(frame.width - 320) <= 4
    assert abs(frame.height - 180) <= 4
    shown = pictures.decode_upright(frame, 1)
    assert abs(float(shown.mean()) - float(np.asarray(photograph()).mean())) < 2.0


def on_plain_ground() -> Image.Image:
    """A thing on white, as in a catalogue."""
    picture = Image.new("RGB", (320, 240), (255, 255, 255))
    picture.paste(photograph().crop((0, 0, 120, 120)), (100, 60))
    return picture


@pytest.mark.parametrize(
    "picture",
    [
        photograph(),
        on_plain_ground(),
        Image.new("RGB", (320, 240), (0, 0, 0)),
        barred((0, 0, 0), 40).crop((0, 0, 320, 220)),  # below alone, as of a caption
    ],
)
def test_a_picture_without_bars_on_both_sides_is_left_as_it_is(picture: Image.Image) -> None:
    assert (read_frame(picture).width, read_frame(picture).height) == picture.size


def test_a_masked_picture_and_a_texture_keep_their_bars(tmp_path: Path) -> None:
    path = tmp_path / "barred.png"
    picture = barred((0, 0, 0), 40)
    picture.save(path)

    assert read_frame(path, np.ones((260, 320), np.bool_)).height == 260
    assert decode_frame(path.read_bytes(), path).height == 260


@pytest.mark.parametrize("suffix", ["png", "jpg"])
def test_colours_are_those_of_the_profile_and_a_texture_has_none(
    tmp_path: Path, suffix: str
) -> None:
    path = tmp_path / f"profiled.{suffix}"
    picture = Image.new("RGB", (64, 64), (200, 40, 40))
    picture.save(path, icc_profile=profile_with_red_and_green_swapped(), quality=100)
    red, green, _ = pictures.decode_upright(read_frame(path), 1).mean(axis=(0, 1))

    assert green > red + 100.0
    texture = decode_frame(path.read_bytes(), path)
    assert pictures.decode_upright(texture, 1).mean(axis=(0, 1))[0] > 190.0


def test_a_broken_profile_is_passed_over(tmp_path: Path) -> None:
    path = tmp_path / "profiled.png"
    Image.new("RGB", (64, 64), (200, 40, 40)).save(path, icc_profile=b"no profile at all")

    assert pictures.decode_upright(read_frame(path), 1)[0, 0].tolist() == [200, 40, 40]


def test_an_engines_screenshot_whose_alpha_is_0_is_looked_at() -> None:
    pixels = np.dstack([np.asarray(photograph()), np.zeros((180, 320), np.uint8)])

    shown = pictures.decode_upright(read_frame(pixels), 1)
    assert np.array_equal(shown, np.asarray(photograph()))


@pytest.mark.parametrize("kind", ["RGB", "RGBA", "P", "L"])
def test_a_texture_larger_than_a_frame_is_the_mean_of_its_pixels(kind: str) -> None:
    side = MAX_SIDE_PX + 1
    stripes = np.zeros((side, side), np.uint8)
    stripes[:, ::2], stripes[side // 2 :] = 100, 200
    file = io.BytesIO()
    Image.fromarray(stripes).convert(kind).save(file, "PNG", compress_level=1)

    frame = decode_frame(file.getvalue(), Path("map.png"))
    pixels = pictures.decode_upright(frame, 1).astype(np.float64)
    middle = frame.height // 2
    assert max(frame.width, frame.height) <= 1024
    assert np.abs(pixels[: middle - 1] - 50.0).max() <= 15.0
    assert np.abs(pixels[middle + 2 :] - 200.0).max() <= 1.0


def test_a_texture_of_64_megapixels_is_in_memory_once(tmp_path: Path) -> None:
    path = tmp_path / "map.png"
    Image.new("L", (8192, 8192), 90).save(path, compress_level=1)
    grown = (
        "import sys; from pathlib import Path; from hapticvlm.vision import files; "
        "status = Path('/proc/self/status'); "
        "peak = lambda: int(status.read_text().partition('VmHWM:')[2].split()[0]); "
        "before = peak(); path = Path(sys.argv[1]); "
        "files.decode_frame(path.read_bytes(), path); print((peak() - before) / 1024)"
    )
    read = subprocess.run(
        [sys.executable, "-c", grown, str(path)], capture_output=True, text=True, check=True
    )
    assert 64.0 <= float(read.stdout) <= 160.0  # MiB, of which 64 are the map
