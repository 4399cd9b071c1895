"""Reads and writes the file of material overrides, which `serve --stated` takes.

    {"objects": [{"object_id": "cup", "material": "glass"},
                 {"object_id": "room", "surfaces": [{}, {"material": "stone"}]}]}

Objects are written as `scene` has them, with their materials alone.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import msgspec
from msgspec import Meta

from hapticvlm import documents
from hapticvlm.materials import Material
from hapticvlm.messages import SceneObject
from hapticvlm.session.overrides import materials_of, materials_only

MOST = 4096  # objects: as many as one `scene` message holds


class _File(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    objects: Annotated[list[SceneObject], Meta(max_length=MOST)]


def read(path: Path, table: Mapping[str, Material]) -> dict[str, SceneObject]:
    """Read the overrides by object id. Raises OSError, and ValueError naming file and fault."""
    try:
        # The file was written by a browser and may have been edited by hand. It is read whole or
        # not at all, and each name is looked up: a material that no table has would otherwise
        # fail at the first touch, in a scene that is running.
        file = documents.read_json(path, _File)
    except ValueError as error:
        text = "--stated names a file that the dashboard's Save gave"
        raise ValueError(f"{path}: {documents.reason(error)}; {text}") from None
    for index, override in enumerate(file.objects):
        place = f"$.objects[{index}]"
        stated = materials_of(override)
        if override != materials_only(override) or not stated:
            text = "state `object_id` and `material`, of the object or of its surfaces"
            raise ValueError(f"{path}: {place}: {text} and nothing else")
        for field, material in stated.items():
            if material not in table:
                text = f"unknown material `{material}`; known: {', '.join(table)}"
                raise ValueError(f"{path}: {place}{field}: {text}")
    return {override.object_id: override for override in file.objects}


def text(stated: Mapping[str, SceneObject]) -> bytes:
    """Write overrides by object id as such a file."""
    written = msgspec.json.encode(_File(list(stated.values())[-MOST:]))
    return msgspec.json.format(written, indent=1) + b"\n"
