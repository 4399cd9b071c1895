"""The bytes of a frame's picture and mask: compared with their own headers, then decoded. Pure.

JPEG is decoded at a power-of-two reduction, which is exact and cheap. Nothing is decoded before
`check_size` has compared the declared size with the picture's own header, so a small file cannot
unfold into gigabytes. Knows no region and no material.
"""

from __future__ import annotations

import struct
from io import BytesIO
from math import ceil

import numpy as np
from numpy.typing import NDArray

from hapticvlm import messages
from hapticvlm.errors import HapticVLMError

Pixels = NDArray[np.uint8]

REDUCTIONS = (8, 4, 2)  # of JPEG's DCT; other scales are slower than none
MAX_CHUNKS = 2048  # of a PNG: 4 MiB in pieces of 8 KiB are 512; each costs the decoder time
MAX_SCANS = 32  # a JPEG of thousands of empty scans keeps a decoder busy for minutes; common: <= 10

_CHANNELS = {"rgb8": 3, "rgba8": 4}
_PNG_MAGIC = b"\x89PNG\r\n\x1a\n"
_CHUNK_FRAME = 12  # bytes of a chunk beside its data: length, kind, checksum
_PNG_HEADER = struct.Struct(">8s4x4sIIB")  # signature, IHDR, width, height, bits per channel


class PictureError(HapticVLMError, ValueError):
    """A picture that cannot be used: which field, why, and what to do."""

    def __init__(self, path: str, text: str) -> None:
        super().__init__(f"{path}: {text}")
        self.path = path


def check_size(frame: messages.Frame) -> None:
    """Compare declared format and size with the bytes; decodes no pixel. Raises PictureError."""
    limit = messages.MAX_SIDE_PX
    for path, side in (("$.width", frame.width), ("$.height", frame.height)):
        if not 1 <= side <= limit:
            raise PictureError(path, f"{side} px is outside 1..{limit}; send a smaller frame")
    if frame.format == "jpeg":
        _require_size("$.image", _jpeg_size(frame.image), frame)
    elif frame.format == "png":
        _require_size("$.image", _png_size("$.image", frame.image), frame)
    else:
        needed = frame.width * frame.height * _CHANNELS[frame.format]
        if len(frame.image) != needed:
            text = f"{len(frame.image)} bytes; {frame.format} {frame.width} x {frame.height} has"
            raise PictureError("$.image", f"{text} {needed}: send whole rows without padding")
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
        return _decode_png("$.image", frame.image, frame, "RGB")
    raw = np.frombuffer(frame.image, np.uint8)
    return raw.reshape(frame.height, frame.width, _CHANNELS[frame.format])[..., :3]


def _decode_jpeg(frame: messages.Frame, reduction: int) -> Pixels:
    import simplejpeg

    _require_few_scans(frame.image)
    try:
        pixels: Pixels = simplejpeg.decode_jpeg(
            frame.image,
            "RGB",
            fastdct=True,
            min_height=ceil(frame.height / reduction),
            min_width=ceil(frame.width / reduction),
            min_factor=reduction,
        )
    except ValueError as error:
        raise PictureError("$.image", f"broken JPEG ({error}); send it again") from None
    return pixels


def _decode_png(path: str, data: bytes, frame: messages.Frame, mode: str) -> Pixels:
    """Decode a PNG of that Pillow mode as it is, any other as (H, W, 3) RGB."""
    from PIL import Image

    try:
        with Image.open(BytesIO(data), formats=("PNG",)) as image:
            # A second header chunk would overrule the one that was checked.
            _require_size(path, image.size, frame)
            return np.asarray(image.convert(mode if image.mode == mode else "RGB"))
    except PictureError:
        raise
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        raise PictureError(path, f"broken PNG ({error}); send it again") from None


def decode_mask(frame: messages.Frame) -> Pixels:
    """Decode the mask to (H, W) of 0 or 255, upright. Raises PictureError."""
    levels = _decode_png("$.mask", frame.mask or b"", frame, "L")
    return np.where(levels if levels.ndim == 2 else levels.any(axis=2), 255, 0).astype(np.uint8)


def _require_size(path: str, found: tuple[int, int], frame: messages.Frame) -> None:
    if found != (frame.width, frame.height):
        text = f"the picture is {found[0]} x {found[1]} px, the frame says"
        raise PictureError(path, f"{text} {frame.width} x {frame.height}; declare its real size")


def _jpeg_size(data: bytes) -> tuple[int, int]:
    import simplejpeg

    try:
        height, width, _, _ = simplejpeg.decode_jpeg_header(data)
    except (ValueError, KeyError) as error:  # KeyError: a colour space it has no name for
        raise PictureError("$.image", f"no JPEG ({error}); check `format`") from None
    return width, height


def _require_few_scans(data: bytes) -> None:
    """Refuse a JPEG that takes minutes to decode. Raises PictureError."""
    # A progressive JPEG is decoded once for each scan. Thousands of empty scans fit into some
    # kilobytes and keep a decoder busy for minutes in C, where no time limit of ours reaches. Their
    # markers are counted before anything is decoded, by whoever decodes: looking through all bytes
    # of every frame took the gateway longer than all else that it checks.
    if data.count(b"\xff\xda") > MAX_SCANS:
        text = f"a JPEG of more than {MAX_SCANS} scans; send a baseline JPEG"
        raise PictureError("$.image", text)


def _png_size(path: str, data: bytes) -> tuple[int, int]:
    if len(data) < _PNG_HEADER.size:
        raise PictureError(path, "no PNG: it ends within its header; send the whole file")
    magic, chunk, width, height, bits = _PNG_HEADER.unpack_from(data)
    if magic != _PNG_MAGIC or chunk != b"IHDR":
        raise PictureError(path, "no PNG: it does not begin like one; check `format`")
    if bits != 8:
        raise PictureError(path, f"a PNG of {bits} bits a channel; send 8")
    _require_few_chunks(path, data)
    return width, height


def _require_few_chunks(path: str, data: bytes) -> None:
    """Refuse a PNG of thousands of chunks, which keeps a decoder busy for seconds."""
    at = len(_PNG_MAGIC)
    for _ in range(MAX_CHUNKS):
        # From chunk to chunk by their own lengths, without reading what they hold. A length that
        # leaves the data ends the walk, and the decoder finds out later; so the walk is bounded by
        # MAX_CHUNKS and by the data, whatever the lengths say.
        at += _CHUNK_FRAME + int.from_bytes(data[at : at + 4], "big")
        if at >= len(data):
            return
    raise PictureError(path, f"a PNG of more than {MAX_CHUNKS} chunks; save it without its extras")
