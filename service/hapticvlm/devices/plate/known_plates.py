"""Remembers the USB ports at which a plate has answered, from one run of the program to the next.

Opening a port resets most boards, and a board that is not a plate may be in the middle of a print.
So a plate is known by its USB descriptor and by its path through hubs: the chips on cheap boards
have no serial number, or all the same one. The file can be deleted; then the port is asked for
once more.
"""

from __future__ import annotations

import contextlib
import json
from pathlib import Path
from typing import NamedTuple

from hapticvlm.cache_folder import cache_folder

FILE = "plates.json"


class UsbIdentity(NamedTuple):
    """Vendor, product and serial number of a device, and the USB path to where it is plugged in."""

    vendor: int
    product: int
    serial: str
    location: str

    @property
    def descriptor(self) -> tuple[int, int, str]:
        """The part that goes with the device to another socket."""
        return self[:3]


def load() -> frozenset[UsbIdentity]:
    """Return the identities of all plates that ever answered; none if the file is damaged."""
    try:
        rows = json.loads(_path().read_bytes())
        return frozenset(
            UsbIdentity(int(vendor), int(product), str(serial), str(location))
            for vendor, product, serial, location in rows
        )
    except (OSError, ValueError, TypeError):
        return frozenset()


def remember(identity: UsbIdentity) -> None:
    """Add a plate; where the file can't be written, it is asked for again next time."""
    known = load()
    if identity in known:
        return
    path = _path()
    with contextlib.suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(sorted({*known, identity})) + "\n", encoding="utf-8")


def _path() -> Path:
    return cache_folder() / FILE
