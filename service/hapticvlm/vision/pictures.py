"""Turns frames into crops: checks headers, decodes, cuts, resizes, detects changes. Pure.

A frame's declared size is compared with its picture's header before anything is decoded, so a small
file cannot unfold into gigabytes. A JPEG is decoded at the largest power-of-two reduction that
leaves the required side in the region, which is exact and cheap; then it is cut and resized. Of a
mask only the bounding box is searched at full size, in its one channel of 1 or 8 bits; everything
else happens to the part that is cut. Knows no material.
"""

from __future__ import annotations

import logging
import re
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from io import BytesIO
from math import ceil, floor
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hapticvlm import documents, messages
from hapticvlm.errors import HapticVLMError
from hapticvlm.vision import focus, tones

if TYPE_CHECKING:
    from PIL import Image

Pixels = NDArray[np.uint8]
REDUCTIONS = (8, 4, 2)  # of JPEG's DCT; other scales are slower than full size
MAX_CHUNKS = 2048  # of a PNG; 4 MiB in pieces of 8 KiB are 512, and each costs decoding time
MAX_SCANS = 32  # of a JPEG; common are up to 10, and thousands keep a decoder busy for minutes
_CHANNELS = {"rgb8": 3, "rgba8": 4, "bgra8": 4}
# Of libjpeg, about bytes that belong to nothing: "... data: 2 extraneous bytes before marker 0xd9".
_STRAY_BYTES = re.compile("[0-9]+ extraneous bytes before marker")
_JPEG_SCAN = b"\xff\xda"
_JPEG_END = b"\xff\xd9"
_PNG_MAGIC = b"\x89PNG\r\n\x1a\n"
_CHUNK_FRAME = 12  # bytes of a chunk beside its data: length, kind, checksum
_PNG_BITS = (1, 2, 4, 8)  # of a channel, or of an index into a palette
_PNG_HEADER = struct.Struct(">8s4x4sIIB")  # signature, IHDR, width, height, bits per channel
# left, top, right, bottom in px of the frame, the last two exclusive
Box = tuple[int, int, int, int]
CENTRE = messages.Region(x=0.25, y=0.25, w=0.5, h=0.5)  # where no region or mask is given
MOST_MARKED = 0.98  # of a picture; a mask that marks more may have another ground than 0
CENTRAL_DISC = 0.8  # diameter of the central mask over the crop's side
MARGIN = 0.05  # of the mask's bounding box, kept around it: surroundings tell glass from paint
CELLS = 8  # cells a side of a signature
MEAN_CHANGE = 4.0  # grey levels, root mean square over the cells, that count as another picture
CELL_CHANGE = 24.0  # grey levels of one cell alone that count: a hand coming in, a lid opening

logger = logging.getLogger(__name__)


class PictureError(HapticVLMError, ValueError):
    """A frame cannot be used; the message names the field (`path`), the reason and the cure."""

    def __init__(self, path: str, text: str) -> None:
        super().__init__(f"{path}: {text}")
        self.path = path
        self.text = text


def check_size(frame: messages.Frame) -> None:
    """Check declared format and size against the bytes; decodes no pixel. Raises PictureError."""
    limit = messages.MAX_SIDE_PX
    for path, side in (("$.width", frame.width), ("$.height", frame.height)):
        if not 1 <= side <= limit:
            raise PictureError(path, f"{side} px is not within 1..{limit}; send a smaller frame")
    if frame.format == "jpeg":
        _require_size("$.image", _jpeg_size(frame.image), frame)
    elif frame.format == "png":
        _require_size("$.image", _png_size("$.image", frame.image), frame)
    else:
        needed = frame.width * frame.height * _CHANNELS[frame.format]
        if len(frame.image) != needed:
            problem = f"{len(frame.image)} bytes; {frame.format} {frame.width} x {frame.height} has"
            raise PictureError("$.image", f"{problem} {needed}; send whole rows without padding")
    if frame.mask is not None:
        _require_size("$.mask", _png_size("$.mask", frame.mask), frame)


def decode_upright(frame: messages.Frame, reduction: int) -> Pixels:
    """Decode to (H', W', 3) RGB, upright; a JPEG at 1 / reduction. Raises PictureError."""
    pixels = _decode(frame, reduction)
    return pixels[::-1] if frame.origin == "bottom" else pixels


def _decode(frame: messages.Frame, reduction: int) -> Pixels:
    """Decode to (H', W', 3) RGB as stored; JPEG at 1 / reduction of its size."""
    if frame.format == "jpeg":
        return _decode_jpeg(frame, reduction)
    if frame.format == "png":
        return np.asarray(_decode_png("$.image", frame.image, frame).convert("RGB"))
    raw = np.frombuffer(frame.image, np.uint8)
    pixels = raw.reshape(frame.height, frame.width, _CHANNELS[frame.format])[..., :3]
    return pixels[..., ::-1] if frame.format == "bgra8" else pixels


def _decode_jpeg(frame: messages.Frame, reduction: int) -> Pixels:
    _require_few_scans(frame.image)
    try:
        try:
            return _decode_scans(frame, reduction, strict=True)
        except ValueError as error:
            # Webcams, phones and scanners write stray bytes before a marker. libjpeg skips them
            # without harm to a pixel, but warns, and a strict decode takes each warning for an
            # error. Only the first warning is reported, and it can hide one of missing data that
            # follows, so the end of the picture must be there as well.
            if not (_STRAY_BYTES.search(str(error)) and _has_end(frame.image)):
                raise
            return _decode_scans(frame, reduction, strict=False)
    except ValueError as error:
        raise PictureError(
            "$.image", f"broken JPEG ({documents.reason(error)}); save it again"
        ) from None


def _decode_scans(frame: messages.Frame, reduction: int, *, strict: bool) -> Pixels:
    """Decode a JPEG; `strict` refuses what libjpeg warns of. Raises ValueError."""
    import simplejpeg

    pixels: Pixels = simplejpeg.decode_jpeg(
        frame.image,
        "RGB",
        min_height=ceil(frame.height / reduction),
        min_width=ceil(frame.width / reduction),
        min_factor=reduction,
        strict=strict,
    )
    return pixels


def _has_end(data: bytes) -> bool:
    """Whether an end marker follows the last scan of a JPEG."""
    return data.find(_JPEG_END, data.rfind(_JPEG_SCAN)) >= 0


def _decode_png(
    path: str, data: bytes, frame: messages.Frame, *, keep_alpha: bool = False
) -> Image.Image:
    """Decode a PNG to mode 1, L, P or RGB, which any other mode is converted to.

    `keep_alpha`: what has transparency stays as it is.
    """
    from PIL import Image

    try:
        with Image.open(BytesIO(data), formats=("PNG",)) as image:
            # A second header chunk would override the one that was checked.
            _require_size(path, image.size, frame)
            image.load()
            if image.mode in ("1", "L", "P") or (keep_alpha and image.has_transparency_data):
                return image
            return image.convert("RGB")
    except PictureError:
        raise
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        raise PictureError(path, f"broken PNG ({documents.reason(error)}); save it again") from None


def decode_mask(frame: messages.Frame) -> Image.Image:
    """Decode the mask, upright, to mode 1 or L: nonzero where any channel is. Raises PictureError.

    A palette's index counts as its colour (mask_levels).
    """
    return mask_levels(_decode_png("$.mask", frame.mask or b"", frame, keep_alpha=True))


def mask_levels(image: Image.Image) -> Image.Image:
    """Return a drawn mask as mode 1 or L, nonzero where the object is; wide levels as mode I.

    An alpha that varies is the mask, whatever the colours are, as drawing programs save a shape on
    a transparent ground. Otherwise what is not black is the object, or what is not the ground.
    """
    from PIL import ImageChops

    if image.has_transparency_data:
        alpha = image.convert("RGBA").getchannel("A")
        lowest, highest = alpha.getextrema()
        if lowest != highest:
            return alpha
        image = image.convert("L" if image.mode == "LA" else "RGB")
    levels = image
    if image.mode == "P":
        colours = np.array(image.getpalette() or [], np.uint8).reshape(-1, 3)
        brightest = np.zeros(256, np.uint8)
        brightest[: len(colours)] = colours.max(axis=1, initial=0)
        levels = image.point(brightest.tolist(), "L")
    elif len(image.getbands()) > 1:
        red, green, blue = image.convert("RGB").split()
        levels = ImageChops.lighter(ImageChops.lighter(red, green), blue)
    return _off_its_ground(image, levels)


def _off_its_ground(image: Image.Image, levels: Image.Image) -> Image.Image:
    """Return the levels, or what differs from the ground of a mask whose ground is not black.

    Numbers of objects that begin at 1, levels of video (16 to 235) and colours have such a ground:
    the commonest value at the edges. White is the object, which may fill the picture.
    """
    from PIL import Image

    left, top, right, bottom = levels.getbbox() or (0, 0, 0, 0)
    if (right - left) * (bottom - top) <= MOST_MARKED * levels.width * levels.height:
        return levels
    values = np.asarray(levels)
    if np.count_nonzero(values) <= MOST_MARKED * values.size:
        return levels
    is_wide = image.mode.startswith("I")
    colours = values if is_wide else np.asarray(image.convert("RGB")) @ np.array([1, 256, 65536])
    edges = np.concatenate([colours[[0, -1]].ravel(), colours[:, [0, -1]].ravel()])
    found, counts = np.unique(edges, return_counts=True)
    ground = found[counts.argmax()]
    inside = colours != ground
    if ground in (0, 0xFFFF if is_wide else 0xFFFFFF) or not inside.any():
        return levels
    _tell_ground(str(values[colours == ground][0]))
    return Image.fromarray(inside)


@lru_cache(maxsize=16)  # once for each level, and not for each frame
def _tell_ground(level: str) -> None:
    message = "a mask marks nearly all of its picture: its ground is taken to be level %s, not 0"
    logger.warning(message, level)


def _require_size(path: str, actual: tuple[int, int], frame: messages.Frame) -> None:
    if actual != (frame.width, frame.height):
        problem = f"the picture is {actual[0]} x {actual[1]} px, the frame says"
        raise PictureError(path, f"{problem} {frame.width} x {frame.height}; declare its real size")


def _jpeg_size(data: bytes) -> tuple[int, int]:
    import simplejpeg

    try:
        height, width, _, _ = simplejpeg.decode_jpeg_header(data)
    except ValueError as error:
        raise PictureError(
            "$.image", f"not a JPEG ({documents.reason(error)}); check `format`"
        ) from None
    except KeyError:  # of simplejpeg, which has no name for the colour space
        problem = "a JPEG of an unknown colour space; send RGB or grey"
        raise PictureError("$.image", problem) from None
    return width, height


def _require_few_scans(data: bytes) -> None:
    """Refuse a JPEG that takes minutes to decode. Raises PictureError."""
    # A progressive JPEG is decoded once for each scan. Thousands of empty scans fit into a few
    # kilobytes and keep a decoder busy for minutes in C code, which none of our time limits can
    # interrupt. Their markers are counted just before decoding and not in the gateway, because a
    # search through all bytes takes longer than all other checks of a frame together.
    if data.count(_JPEG_SCAN) > MAX_SCANS:
        problem = f"a JPEG of more than {MAX_SCANS} scans; send a baseline JPEG"
        raise PictureError("$.image", problem)


def _png_size(path: str, data: bytes) -> tuple[int, int]:
    if len(data) < _PNG_HEADER.size:
        raise PictureError(path, "not a PNG: it ends within its header; send the whole file")
    magic, chunk, width, height, bits = _PNG_HEADER.unpack_from(data)
    if magic != _PNG_MAGIC or chunk != b"IHDR":
        raise PictureError(path, "not a PNG: its signature is missing; check `format`")
    if bits not in _PNG_BITS:
        raise PictureError(path, f"a PNG of {bits} bits a channel; send 8 or fewer")
    _require_few_chunks(path, data)
    return width, height


def _require_few_chunks(path: str, data: bytes) -> None:
    """Refuse a PNG of thousands of chunks, which keeps a decoder busy for seconds."""
    at = len(_PNG_MAGIC)
    for _ in range(MAX_CHUNKS):
        # Steps from chunk to chunk by their lengths, without reading their content. A length that
        # leads out of the data ends the loop (the decoder refuses the file later), so the loop is
        # bounded by MAX_CHUNKS and by the size of the data, whatever the lengths are.
        at += _CHUNK_FRAME + int.from_bytes(data[at : at + 4], "big")
        if at >= len(data):
            return
    raise PictureError(path, f"a PNG of more than {MAX_CHUNKS} chunks; save it without its extras")


@dataclass(frozen=True, slots=True)
class Crop:
    """A square cut-out, upright: image (S, S, 3) uint8 RGB, mask (S, S) uint8, nonzero = object.

    `levels` are those of the frame that the image's 0 and 255 stand for (tones.py).
    """

    image: Pixels
    mask: Pixels
    levels: tones.Levels = tones.WHOLE


@dataclass(frozen=True, slots=True)
class Thumbnail:
    """A small upright picture of a frame as JPEG, and of its mask, if any, as PNG."""

    jpeg: bytes
    mask: bytes | None


def check_header(frame: messages.Frame) -> None:
    """Check a frame against its pictures' headers, and its region; decodes no pixel.

    Raises PictureError.
    """
    check_size(frame)
    _region_box(frame, frame.region)


def crop(frame: messages.Frame, side: int) -> Crop:
    """Cut the object out of a frame as a (side, side) picture and mask.

    The tones of a hazy and of a dark picture are stretched, and a picture that is sharp in a few
    places only is blurred. Raises PictureError.
    """
    return crops(frame, [frame.region], side)[0]


def crops(
    frame: messages.Frame, regions: Sequence[messages.Region | None], side: int
) -> list[Crop]:
    """Cut several regions out of a frame, each as `crop` would if it were the frame's region.

    The mask is decoded once, the picture once for each reduction of the JPEG. Raises PictureError.
    """
    check_header(frame)
    mask = None if frame.mask is None else decode_mask(frame)
    cuts = [_cut(frame, region, mask) for region in regions]
    reductions = [_reduction(frame, box, side) for box, _ in cuts]
    # Decoding is the most expensive step, and a JPEG can be decoded at a half, a quarter or an
    # eighth of its size in a fraction of the time. Each region takes the largest reduction that
    # leaves it the encoder's side. Regions of one reduction share the decoded picture, which none
    # of them changes.
    decoded = {reduction: decode_upright(frame, reduction) for reduction in set(reductions)}
    return [
        _crop(frame, decoded[reduction], cut, side)
        for cut, reduction in zip(cuts, reductions, strict=True)
    ]


def whole(frame: messages.Frame, side: int) -> tuple[Pixels, messages.Region]:
    """Decode the upright frame at the largest reduction with `side` px or more a side.

    Returns (H, W, 3) uint8, and the region of the object: the mask's, else the frame's, else the
    centre. Raises PictureError.
    """
    check_header(frame)
    mask = None if frame.mask is None else decode_mask(frame)
    left, top, right, bottom = _cut(frame, frame.region, mask)[0]
    pixels = decode_upright(frame, _reduction(frame, (0, 0, frame.width, frame.height), side))
    x = 1.0 / frame.width
    y = 1.0 / frame.height
    region = messages.Region(x=left * x, y=top * y, w=(right - left) * x, h=(bottom - top) * y)
    return pixels, region


def cut_region(frame: messages.Frame, region: messages.Region, side: int) -> Pixels:
    """Decode a region at the largest reduction with `side` px or more a side: (H, W, 3) uint8.

    Raises PictureError.
    """
    check_header(frame)
    box = _region_box(frame, region)
    pixels = decode_upright(frame, _reduction(frame, box, side))
    x = pixels.shape[1] / frame.width
    y = pixels.shape[0] / frame.height
    left, top = floor(box[0] * x), floor(box[1] * y)
    return pixels[top : max(top + 1, round(box[3] * y)), left : max(left + 1, round(box[2] * x))]


def thumbnail(frame: messages.Frame, side: int) -> Thumbnail:
    """Return the whole frame, upright, at most `side` px a side. Raises PictureError."""
    import simplejpeg
    from PIL import Image

    pixels, _ = whole(frame, side)
    image = Image.fromarray(np.ascontiguousarray(pixels))
    image.thumbnail((side, side))
    jpeg = simplejpeg.encode_jpeg(np.asarray(image), quality=80)
    if frame.mask is None:
        return Thumbnail(jpeg, None)
    mask = decode_mask(frame).point([0] + [255] * 255).convert("L")
    mask.thumbnail((side, side), Image.Resampling.NEAREST)
    file = BytesIO()
    mask.save(file, "PNG")
    return Thumbnail(jpeg, file.getvalue())


@cache
def central_mask(side: int) -> Pixels:
    """Draw the disc that counts as the object without a mask: (side, side) uint8, 0 or 255.

    The array is shared and read-only.
    """
    axis = (np.arange(side) + 0.5) / side - 0.5
    inside = axis[:, None] ** 2 + axis[None, :] ** 2 <= (CENTRAL_DISC / 2) ** 2
    disc = _levels(inside)
    disc.setflags(write=False)
    return disc


def signature(crop: Crop) -> NDArray[np.float32]:
    """Average a crop over CELLS x CELLS cells: (4 CELLS^2,) float32 of RGB and mask, 0..255."""
    # JPEG noise or a pixel of jitter hardly changes a cell's mean, but would change a hash.
    cells = np.dstack([_cells(crop.image), _cells(crop.mask)])
    edges = _cell_edges(crop.mask.shape[0])
    size = np.diff(np.append(edges, crop.mask.shape[0])).astype(np.float32)
    means: NDArray[np.float32] = cells / (size[:, None] * size[None, :])[..., None]
    return means.ravel()


def has_changed(before: NDArray[np.float32], after: NDArray[np.float32]) -> bool:
    """Whether two signatures show different pictures, beyond JPEG noise and a pixel of jitter."""
    moved = np.abs(before - after)
    mean = float(np.sqrt(np.mean(moved**2)))
    return mean > MEAN_CHANGE or float(moved.max()) > CELL_CHANGE


def _cells(plane: Pixels) -> NDArray[np.float32]:
    """Sum (S, S) or (S, S, C) over its cells: (CELLS, CELLS, C or 1) float32."""
    side = plane.shape[0]
    edges = _cell_edges(side)
    # Two passes, first over rows, then over columns. The first adds whole rows, pixel by pixel and
    # colour by colour alike, so it runs over contiguous memory.
    rows = np.add.reduceat(plane.reshape(side, -1).astype(np.float32), edges, axis=0)
    cells: NDArray[np.float32] = np.add.reduceat(rows.reshape(CELLS, side, -1), edges, axis=1)
    return cells


def _cell_edges(side: int) -> NDArray[np.int64]:
    return np.linspace(0, side, CELLS + 1).astype(int)[:-1]


def _cut(
    frame: messages.Frame, region: messages.Region | None, mask: Image.Image | None
) -> tuple[Box, Pixels | None]:
    """Find the box to cut, and the mask in it, 0 or 255; with a region, what is inside counts."""
    if mask is None:
        return _region_box(frame, region), None
    left, top = 0, 0
    if region is not None:
        box = _region_box(frame, region)
        mask = mask.crop(box)
        left, top = box[:2]
    bounds = mask.getbbox()
    if bounds is None:
        raise PictureError("$.mask", "no pixel is nonzero; mark the object or leave the mask out")
    x = ceil((bounds[2] - bounds[0]) * MARGIN)
    y = ceil((bounds[3] - bounds[1]) * MARGIN)
    box = (
        max(0, left + bounds[0] - x),
        max(0, top + bounds[1] - y),
        min(frame.width, left + bounds[2] + x),
        min(frame.height, top + bounds[3] + y),
    )
    # A margin that leaves the region is cut beyond the image's edge, where Pillow puts zeros.
    part = mask.crop((box[0] - left, box[1] - top, box[2] - left, box[3] - top))
    return box, _levels(np.asarray(part) > 0)


def _reduction(frame: messages.Frame, box: Box, side: int) -> int:
    """Choose the largest reduction that leaves `side` px in the box; 1 unless it is a JPEG."""
    # The shorter side of the box decides; otherwise a narrow object would be enlarged again.
    within = min(box[2] - box[0], box[3] - box[1]) if frame.format == "jpeg" else 0
    return next((k for k in REDUCTIONS if within // k >= side), 1)


def _crop(frame: messages.Frame, pixels: Pixels, cut: tuple[Box, Pixels | None], side: int) -> Crop:
    box, mask = cut
    x = pixels.shape[1] / frame.width
    y = pixels.shape[0] / frame.height
    image = resize(pixels, (box[0] * x, box[1] * y, box[2] * x, box[3] * y), side)
    image, levels = tones.stretched(image)
    if mask is None:
        inside = central_mask(side)
    else:
        shares = resize(mask, (0.0, 0.0, float(mask.shape[1]), float(mask.shape[0])), side)
        half = min(128, int(shares.max()))  # in a mask of thin lines no cell is half covered
        inside = _levels(shares >= half)
    return Crop(focus.evened(image, inside), inside, levels)


def _levels(inside: NDArray[np.bool_]) -> Pixels:
    """Return 255 where a mask is true, 0 elsewhere."""
    return np.multiply(inside, np.uint8(255), dtype=np.uint8)


def _region_box(frame: messages.Frame, region: messages.Region | None) -> Box:
    """Return a region, or the centre, in px of the upright frame, clipped to it."""
    region = region or CENTRE
    left = round(region.x * frame.width)
    top = round(region.y * frame.height)
    right = min(frame.width, ceil((region.x + region.w) * frame.width))
    bottom = min(frame.height, ceil((region.y + region.h) * frame.height))
    if left >= right or top >= bottom:
        raise PictureError("$.region", "lies outside the frame; x + w and y + h end within 0..1")
    return left, top, right, bottom


def resize(pixels: Pixels, box: tuple[float, float, float, float], side: int) -> Pixels:
    """Cut a box (left, top, right, bottom, px) out of pixels and resize it to (side, side, 3)."""
    from PIL import Image

    left, top, right, bottom = box
    if (right - left, bottom - top) == (side, side) and left.is_integer() and top.is_integer():
        return np.ascontiguousarray(pixels[int(top) : int(bottom), int(left) : int(right)])
    # Pillow copies all that it is given, so it is given the box and the pixels around it that the
    # filter reaches: the length of one pixel of the result, or of one source pixel if that is more.
    reach = ceil(max(right - left, bottom - top, side) / side) + 1
    x = max(0, floor(left) - reach)
    y = max(0, floor(top) - reach)
    part = np.ascontiguousarray(pixels[y : ceil(bottom) + reach, x : ceil(right) + reach])
    small = Image.fromarray(part).resize(
        (side, side), Image.Resampling.BILINEAR, box=(left - x, top - y, right - x, bottom - y)
    )
    return np.asarray(small)
