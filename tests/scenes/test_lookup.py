"""Tests that a thing is found in a bake by id, path and material, by an index last."""

from __future__ import annotations

from typing import Any

import identity
import msgspec

from hapticvlm.scenes.bake import Materials
from hapticvlm.scenes.lookup import Lookup, Query


def test_the_shared_cases_hold() -> None:
    objects = msgspec.json.decode(identity.FILE.read_bytes(), type=Materials).objects
    lookup = Lookup(objects)

    def answer(ask: dict[str, Any]) -> Any:
        query = msgspec.convert(
            {name: given for name, given in ask.items() if given is not None}, Query
        )
        found = lookup.find(query)
        if found is None:
            return lookup.nearest(query.object_id or "")
        return [found.object_id, found.surface, found.by]

    assert identity.differences([answer(case["ask"]) for case in identity.CASES]) == []
