"""Turns pictures and masks into the upright frames a scene would send. Knows no material.

A picture is a file, an image of Pillow or an array. A plain JPEG file is passed on unchanged, so
that it is decoded as the service decodes it. Any other picture is turned as its EXIF states,
converted to 8-bit RGB on a grey ground and shrunk to the largest frame. What is looked at loses its
uniform bars and gets the colours of its profile, as viewers show it. Animations are refused,
because only the user knows which of their pictures counts.
"""

from __future__ import annotations

import re
import struct
import warnings
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageCms, features

from hapticvlm import documents
from hapticvlm.errors import HapticVLMError
from hapticvlm.messages import MAX_SIDE_PX, WHOLE, Frame
from hapticvlm.vision import pictures
from hapticvlm.vision.bars import content_box

SUFFIXES = frozenset({".jpg", ".jpeg", ".png", ".webp"})
# The first bytes of what is read, whatever its name (Chrome saves JPEGs as .jfif), and of pictures
# that are not read, under the name of their kind.
_READ = re.compile(rb"\xff\xd8\xff|\x89PNG\r\n\x1a\n|RIFF....WEBP", re.DOTALL)
_NOT_READ = {
    "AVIF": re.compile(rb"....ftypavi[fs]", re.DOTALL),
    "HEIC": re.compile(rb"....ftyp(hei[cxms]|hev[cxms]|mif1|msf1)", re.DOTALL),
    "GIF": re.compile(rb"GIF8[79]a"),
    "BMP": re.compile(rb"BM....\0\0\0\0", re.DOTALL),
    "TIFF": re.compile(rb"II\*\0|MM\0\*"),
    "JPEG XL": re.compile(rb"\xff\x0a|\0\0\0\x0cJXL "),
}
_HEAD_BYTES = 16
FORMATS = ("JPEG", "PNG", "WEBP")
MAX_BYTES = 64 * documents.MIB
GROUND = (127, 127, 127)  # behind what is transparent
_MAP_PX = 1024  # side of a texture that is larger than a frame; its material is read off 256 px
_BAND_PX = 64  # height of what is converted at a time, after reduction

_BARS_PX = 256  # least side at which a JPEG is searched for bars
_OPAQUE = 128  # alpha
_SHOWN = 0.01  # least share of opaque pixels; with fewer the alpha does not count
_PROFILED = ("RGB", "RGBA", "CMYK", "L")  # modes whose colour profile is applied
_NO_LEVELS = ("F", "I", "La")  # modes without a level of white; a PNG of mode I has 16 bits
_ORIENTATION = 0x0112  # of EXIF
_TURNS = {
    2: Image.Transpose.FLIP_LEFT_RIGHT,
    3: Image.Transpose.ROTATE_180,
    4: Image.Transpose.FLIP_TOP_BOTTOM,
    5: Image.Transpose.TRANSPOSE,
    6: Image.Transpose.ROTATE_270,
    7: Image.Transpose.TRANSVERSE,
    8: Image.Transpose.ROTATE_90,
}
_QUARTER = 5  # from this orientation on width and height change places
_UNREADABLE = (OSError, ValueError, SyntaxError, EOFError, KeyError, struct.error, MemoryError)


Source = str | Path | Image.Image | NDArray[Any]  # of a picture, or of a mask


class FileError(HapticVLMError, ValueError):
    """A picture or a mask cannot be used; the message names it, the reason and the cure."""


def list_files(folder: Path) -> list[Path]:
    """List the pictures directly in a folder, except hidden ones, in order of name.

    Their ending or their first bytes say that they are JPEG, PNG or WebP.
    """
    return [
        path
        for path in _visible_files(folder)
        if path.suffix.lower() in SUFFIXES or _READ.match(_head(path))
    ]


def left_out(folder: Path) -> str | None:
    """Say which pictures `list_files` leaves out, such as "2 HEIC, 1 GIF"; None if there are none.

    They are known by their first bytes; other files are not counted.
    """
    others = (path for path in _visible_files(folder) if path.suffix.lower() not in SUFFIXES)
    heads = [_head(path) for path in others]
    kinds = Counter(kind for head in heads for kind, mark in _NOT_READ.items() if mark.match(head))
    return ", ".join(f"{count} {kind}" for kind, count in kinds.most_common()) or None


def _visible_files(folder: Path) -> list[Path]:
    paths = sorted(folder.iterdir())
    return [path for path in paths if path.is_file() and not path.name.startswith(".")]


def _head(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            return file.read(_HEAD_BYTES)
    except OSError:
        return b""  # what cannot be opened shows no kind


def read_frame(picture: Source, mask: Source | None = None) -> Frame:
    """Return the frame of a picture, with a mask of its upright size (nonzero = object).

    - `picture`: a JPEG, PNG or WebP file, an image of Pillow, or an array of uint8: (H, W) grey,
      (H, W, 3) RGB or (H, W, 4) RGBA, the top row first.
    - `mask`: the same, or an array of bool.

    Raises FileError.
    """
    with _quiet():
        name, data, image = _image(picture, "picture")
        with image:
            return _upright(name, data, image, mask, is_shown=True)


def decode_frame(data: bytes, path: Path) -> Frame:
    """Decode a texture in memory as renderers do: no profile counts, and no bar is cut.

    Errors name it by `path`. Raises FileError.
    """
    with _quiet(), _open(path, data) as image:
        return _upright(str(path), data, image, None, is_shown=False)


@contextmanager
def _quiet() -> Iterator[None]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # of broken EXIF: only the pixels matter
        warnings.simplefilter("error", Image.DecompressionBombWarning)
        yield


def _image(source: Source, role: str) -> tuple[str, bytes | None, Image.Image]:
    """Return the name of a picture or mask for errors, the bytes of a file, and the image."""
    if isinstance(source, str | Path):
        data = _read(Path(source))
        return str(source), data, _open(Path(source), data)
    if isinstance(source, Image.Image):
        if source.mode in _NO_LEVELS and source.format != "PNG" and role == "picture":
            cure = "convert it to mode L, RGB or RGBA with levels of 0..255"
            raise FileError(f"{role}: an image of mode {source.mode}; {cure}")
        try:
            return role, None, source.copy()  # not to decode, turn or close the caller's own
        except _UNREADABLE as error:
            reason = documents.reason(error)
            raise FileError(f"{role}: broken ({reason}); open it again") from None
    if not isinstance(source, np.ndarray):
        kind = type(source).__name__
        raise FileError(f"{role}: {kind}; give a path, an image of Pillow or an array of numpy")
    return role, None, _image_of(source, role)


def _image_of(source: NDArray[Any], role: str) -> Image.Image:
    """Return the image of an array. Raises FileError for another type or shape."""
    pixels = source.astype(np.uint8) * 255 if source.dtype == np.bool_ else source
    is_grey, is_colour = pixels.ndim == 2, pixels.ndim == 3 and pixels.shape[2] in (3, 4)
    if pixels.dtype != np.uint8 or not (is_grey or is_colour) or not pixels.size:
        shape = f"an array of {source.dtype}, {source.shape}"
        cure = "give uint8 of 0..255 as (H, W), (H, W, 3) or (H, W, 4)"
        raise FileError(f"{role}: {shape}; {cure}")
    return Image.fromarray(np.ascontiguousarray(pixels))


def _upright(
    name: str, data: bytes | None, image: Image.Image, mask: Source | None, *, is_shown: bool
) -> Frame:
    profile = _foreign_profile(image) if is_shown else None
    cut_bars = is_shown and mask is None
    turn = _orientation(image)
    size = image.size[::-1] if turn >= _QUARTER else image.size
    # A JPEG that needs no change keeps its own bytes. Decoded and encoded again, its pixels would
    # differ from those that a scene sends, and references made from it would match less well.
    is_plain = profile is None and max(size) <= MAX_SIDE_PX and _is_plain_jpeg(image)
    if data is not None and is_plain and not (cut_bars and _has_bars(data)):
        return _frame("jpeg", data, size, _mask(mask, size, size))
    try:
        pixels = _pixels(image if is_shown else _reduced(image), turn, profile)
    except (*_UNREADABLE, Image.DecompressionBombError) as error:
        raise FileError(
            f"{name}: broken picture ({documents.reason(error)}); save it again"
        ) from None
    if cut_bars:
        pixels = _without_bars(pixels)
    shrunk = (pixels.shape[1], pixels.shape[0])
    return _frame("rgb8", pixels.tobytes(), shrunk, _mask(mask, size, shrunk))


def _is_plain_jpeg(image: Image.Image) -> bool:
    """Whether it is a JPEG that is neither turned nor of other colours."""
    return image.format == "JPEG" and image.mode in ("RGB", "L") and _orientation(image) == 1


def _without_bars(pixels: NDArray[np.uint8]) -> NDArray[np.uint8]:
    box = content_box(pixels)
    return pixels if box is None else np.ascontiguousarray(pixels[box[1] : box[3], box[0] : box[2]])


def _has_bars(data: bytes) -> bool:
    """Whether a JPEG has bars, by a decoding at a fraction of its size."""
    with Image.open(BytesIO(data)) as image:
        image.draft("RGB", (_BARS_PX, _BARS_PX))
        try:
            return content_box(np.asarray(image.convert("RGB"))) is not None
        except _UNREADABLE:
            return False  # whoever decodes it says so


def _foreign_profile(image: Image.Image) -> ImageCms.ImageCmsProfile | None:
    """Return the colour profile of a picture that is not in sRGB; None if it is, or is broken."""
    data = image.info.get("icc_profile")
    if not data or image.mode not in _PROFILED:
        return None
    try:
        profile = ImageCms.ImageCmsProfile(BytesIO(data))
        is_srgb = "srgb" in ImageCms.getProfileDescription(profile).lower()
    except (*_UNREADABLE, ImageCms.PyCMSError, TypeError):
        return None
    return None if is_srgb else profile


def _as_shown(image: Image.Image, profile: ImageCms.ImageCmsProfile) -> Image.Image:
    """Convert a picture to sRGB as viewers do; one whose profile does not fit stays as it is."""
    mode = "RGBA" if image.mode == "RGBA" else "RGB"
    image.load()  # so that a broken picture is not taken for a broken profile
    try:
        shown = ImageCms.profileToProfile(
            image, profile, ImageCms.createProfile("sRGB"), outputMode=mode
        )
    except ImageCms.PyCMSError:
        return image
    return image if shown is None else shown


def _frame(
    form: Literal["jpeg", "rgb8"], data: bytes, size: tuple[int, int], mask: bytes | None
) -> Frame:
    return Frame(
        id=1,
        captured_at=0.0,
        format=form,
        width=size[0],
        height=size[1],
        image=data,
        origin="top",
        mask=mask,
        region=WHOLE if mask is None else None,
    )


def _read(path: Path) -> bytes:
    try:
        return documents.read_bytes(path, MAX_BYTES)
    except (OSError, ValueError) as error:
        raise FileError(f"{path}: {documents.reason(error)}") from None


def _open(path: Path, data: bytes) -> Image.Image:
    try:
        image = Image.open(BytesIO(data), formats=_formats(data))
    except (Image.DecompressionBombError, Image.DecompressionBombWarning):
        limit = f"more than {Image.MAX_IMAGE_PIXELS or 0:,} px"
        raise FileError(f"{path}: {limit}; shrink it") from None
    except _UNREADABLE:
        raise FileError(f"{path}: not a JPEG, PNG or WebP; save it as one") from None
    # A phone's JPEG may hold a second picture, for depth or gain; that is not an animation.
    count = 1 if image.format in ("JPEG", "MPO") else getattr(image, "n_frames", 1)
    if count > 1:
        raise FileError(f"{path}: an animation of {count} pictures; save the one you mean")
    return image


def _formats(data: bytes) -> tuple[str, ...]:
    """Return the formats to try; AVIF, which maps of scenes use, where Pillow has it (11.3)."""
    is_avif = _NOT_READ["AVIF"].match(data) and features.check("avif")
    return ("AVIF",) if is_avif else FORMATS


def _orientation(image: Image.Image) -> int:
    try:
        turn = image.getexif().get(_ORIENTATION, 1)
    except (*_UNREADABLE, TypeError):
        return 1  # viewers show a picture with broken EXIF, so it is accepted
    return turn if turn in _TURNS else 1


def _pixels(
    image: Image.Image, turn: int, profile: ImageCms.ImageCmsProfile | None
) -> NDArray[np.uint8]:
    """Decode to (H, W, 3) uint8 RGB, upright, at most MAX_SIDE_PX a side."""
    limit = (MAX_SIDE_PX, MAX_SIDE_PX)
    if max(image.size) > MAX_SIDE_PX:
        image.draft(None, limit)  # decodes a JPEG smaller; has no effect on other formats
    whole = _rgb(image if profile is None else _as_shown(image, profile))
    if turn in _TURNS:
        whole = whole.transpose(_TURNS[turn])
    whole.thumbnail(limit)
    return np.asarray(whole)


def _reduced(image: Image.Image) -> Image.Image:
    """Return a texture of at most MAX_SIDE_PX a side; a larger one has _MAP_PX.

    Maps of 64 megapixels are common. Pillow decodes a PNG whole, at 4 bytes a pixel; what follows
    happens in bands, so that no second picture of that size is in memory.
    """
    if max(image.size) <= MAX_SIDE_PX or image.mode.startswith("I"):
        return image
    image.draft(None, (_MAP_PX, _MAP_PX))  # decodes a JPEG smaller
    factor = -(-max(image.size) // _MAP_PX)
    mode = "RGBA" if image.has_transparency_data else "RGB"
    width, height = image.size
    small = Image.new(mode, (-(-width // factor), -(-height // factor)))
    for top in range(0, small.height, _BAND_PX):
        below = min(height, factor * (top + _BAND_PX))
        band = image.crop((0, factor * top, width, below)).convert(mode)
        small.paste(band.reduce(factor), (0, top))
    return small


def _rgb(image: Image.Image) -> Image.Image:
    if image.mode.startswith("I"):  # 16-bit grey, which Pillow would clip instead of scaling
        levels = np.asarray(image).astype(np.int64) >> 8
        return Image.fromarray(levels.clip(0, 255).astype(np.uint8)).convert("RGB")
    if not image.has_transparency_data:
        return image.convert("RGB")
    over = image.convert("RGBA")
    if np.mean(np.asarray(over.getchannel("A")) >= _OPAQUE) < _SHOWN:
        return over.convert("RGB")  # an engine's screenshot, whose alpha is not what is seen
    ground = Image.new("RGB", image.size, GROUND)
    ground.paste(over, mask=over.getchannel("A"))
    return ground


def _mask(mask: Source | None, upright: tuple[int, int], size: tuple[int, int]) -> bytes | None:
    """Return a mask of the picture's upright size as a 1-bit PNG of `size`."""
    if mask is None:
        return None
    name, _, image = _image(mask, "mask")
    with image:
        if image.size != upright:
            problem = (
                f"{name}: the mask is {image.size[0]} x {image.size[1]} px, its upright picture"
            )
            raise FileError(f"{problem} {upright[0]} x {upright[1]}; save both at one size")
        try:
            levels = np.asarray(pictures.mask_levels(image))
        except (*_UNREADABLE, Image.DecompressionBombError) as error:
            raise FileError(
                f"{name}: broken mask ({documents.reason(error)}); save it again"
            ) from None
    inside = levels != 0
    if not inside.any():
        raise FileError(f"{name}: no pixel is nonzero; mark the object or leave the mask out")
    data = BytesIO()
    marked = Image.fromarray(inside)
    marked.resize(size, Image.Resampling.NEAREST).save(data, "PNG", compress_level=1)
    return data.getvalue()
