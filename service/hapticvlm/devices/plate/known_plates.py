"""Remembers at which USB ports a plate has answered, and at which something else did.

Opening a port resets most boards, and a board that is not a plate may be in the middle of a print.
So a plate is known by its USB descriptor and by its path through hubs: the chips on cheap boards
have no serial number, or all the same one. The file can be deleted; then the port is asked for
once more.
"""

from __future__ import annotations

import contextlib
import json
from collections.abc import Collection
from pathlib import Path
from typing import NamedTuple

from hapticvlm import documents
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


class Known(NamedTuple):
    """The ports at which a plate answered, and those at which something else did."""

    plates: frozenset[UsbIdentity] = frozenset()
    strangers: frozenset[UsbIdentity] = frozenset()

    def may_open(self, identity: UsbIdentity) -> bool:
        """Whether nothing but a plate ever answered there.

        A stranger with a serial number is one wherever it is plugged in; another one is told by its
        socket alone.
        """
        if not identity.serial:
            return identity not in self.strangers
        return identity.descriptor not in {other.descriptor for other in self.strangers}


def load() -> Known:
    """Return what is known of ports; nothing if the file is damaged."""
    try:
        kinds = json.loads(_path().read_bytes())
        return Known(*(frozenset(map(_identity, kinds[kind])) for kind in Known._fields))
    except (OSError, ValueError, TypeError, KeyError):
        return Known()


def remember(identity: UsbIdentity) -> None:
    """Add a plate; where the file can't be written, it is asked for again next time."""
    known = load()
    others = {one for one in known.strangers if one.descriptor != identity.descriptor}
    _save(known, Known(known.plates | {identity}, frozenset(others)))


def avoid(identity: UsbIdentity) -> None:
    """Add a port at which something answered that is no plate."""
    known = load()
    _save(known, Known(known.plates, known.strangers | {identity}))


def forget_unplugged(present: Collection[UsbIdentity]) -> Known:
    """Forget the strangers without a serial number that are not plugged in; return what is left."""
    known = load()
    left = Known(known.plates, frozenset(s for s in known.strangers if s.serial or s in present))
    _save(known, left)
    return left


def _save(before: Known, known: Known) -> None:
    if known == before:
        return
    path = _path()
    text = json.dumps({kind: sorted(ports) for kind, ports in known._asdict().items()})
    with contextlib.suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        documents.replace_file(path, f"{text}\n")


def _identity(row: tuple[int, int, str, str]) -> UsbIdentity:
    vendor, product, serial, location = row
    return UsbIdentity(int(vendor), int(product), str(serial), str(location))


def _path() -> Path:
    return cache_folder() / FILE
