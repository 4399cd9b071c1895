"""Read a QR code as a phone's camera does: held nearer, held further, turned."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING

import cv2
import numpy as np
import numpy.typing as npt
from PIL import Image

if TYPE_CHECKING:
    from playwright.sync_api import Page

# OpenCV's detector misses some codes at one size (7 of 2,000 addresses that differ by their port)
# and reads the same code at another.
SIDES_PX = (None, 200, 300, 420, 600, 777)


def read_from_page(page: Page) -> str:
    """The address that the page's code shows, once it is drawn; the page says it in words, too."""
    code = page.locator("#qr")
    code.wait_for()
    page.wait_for_load_state("networkidle")
    read = read_code(np.asarray(Image.open(io.BytesIO(code.screenshot())).convert("RGB")))
    assert read in page.inner_text("#reach-said")
    return read


def read_code(picture: npt.NDArray[np.uint8]) -> str:
    """The text of the one code in `picture` (grey or RGB), "" if it is read at no size and turn."""
    for side in SIDES_PX:
        held = (
            picture
            if side is None
            else cv2.resize(picture, (side, side), interpolation=cv2.INTER_AREA)
        )
        framed = cv2.copyMakeBorder(held, 20, 20, 20, 20, cv2.BORDER_REPLICATE)
        for turns in range(4):
            read = str(
                cv2.QRCodeDetector().detectAndDecode(np.ascontiguousarray(np.rot90(framed, turns)))[
                    0
                ]
            )
            if read:
                return read
    return ""
