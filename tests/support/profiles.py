"""Colour profiles for pictures of tests."""

from PIL import ImageCms


def profile_with_red_and_green_swapped() -> bytes:
    """An sRGB profile whose first two primaries are swapped and that has another name."""
    data = bytearray(ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes())
    count = int.from_bytes(data[128:132], "big")
    at = {bytes(data[132 + 12 * n : 136 + 12 * n]): 132 + 12 * n for n in range(count)}
    red, green = at[b"rXYZ"], at[b"gXYZ"]
    data[red + 4 : red + 12], data[green + 4 : green + 12] = (
        data[green + 4 : green + 12],
        data[red + 4 : red + 12],
    )
    return (
        bytes(data)
        .replace(b"s\0R\0G\0B", b"o\0t\0h\0r")
        .replace(b"sRGB built-in", b"othr built-in")
    )
