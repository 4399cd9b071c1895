"""Reads and writes the file of material overrides, which `serve --stated` takes.

    {"objects": [{"object_id": "cup", "material": "glass"}]}

Objects are written as `scene` has them.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import msgspec
from msgspec import Meta

from hapticvlm import documents
from hapticvlm.materials import Material
from hapticvlm.messages import MaterialName, ObjectId

MOST = 4096  # objects: as many as one `scene` message holds


class _Stated(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    object_id: ObjectId
    material: MaterialName


class _File(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    objects: Annotated[list[_Stated], Meta(max_length=MOST)]


def read(path: Path, table: Mapping[str, Material]) -> dict[str, str]:
    """Read the materials by object id. Raises OSError, and ValueError naming file and fault."""
    try:
        # The file was written by a browser and may have been edited by hand. It is read whole or
        # not at all, and each name is looked up: a material that no table has would otherwise
        # fail at the first touch, in a scene that is running.
        file = msgspec.json.decode(documents.read_bytes(path), type=_File)
    except (ValueError, RecursionError) as error:
        text = "--stated names a file that the dashboard's Save gave"
        raise ValueError(f"{path}: {documents.reason(error)}; {text}") from None
    for index, given in enumerate(file.objects):
        if given.material not in table:
            text = f"unknown material `{given.material}`; known: {', '.join(table)}"
            raise ValueError(f"{path}: $.objects[{index}].material: {text}")
    return {given.object_id: given.material for given in file.objects}


def text(stated: Mapping[str, str]) -> bytes:
    """Write materials by object id as such a file."""
    objects = [_Stated(object_id, material) for object_id, material in stated.items()]
    written = msgspec.json.encode(_File(objects[-MOST:]))
    return msgspec.json.format(written, indent=1) + b"\n"
