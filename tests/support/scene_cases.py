"""The scene cases of `tests/scene_cases.json`, which the service and all clients have to pass.

Each case has the objects of a scene with something out of order, the material felt of each usable
object, and the parts that are left out. `crowd` adds so many wooden objects behind the others,
`thing0` and so on, each with `crowd_name` if there is one.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

FILE = Path(__file__).parents[1] / "scene_cases.json"
CASES: list[dict[str, Any]] = json.loads(FILE.read_text())


def objects_of(case: dict[str, Any]) -> list[dict[str, Any]]:
    """Return all objects of a case, its crowd included."""
    name = {"name": case["crowd_name"]} if "crowd_name" in case else {}
    crowd = range(len(case["objects"]), case.get("crowd", 0))
    return [
        *case["objects"],
        *({"object_id": f"thing{number}", "material": "wood", **name} for number in crowd),
    ]


def of_clients() -> list[dict[str, Any]]:
    """Return the cases as a client runs them.

    `touch` are the objects to touch, `felt` their materials, `tells` whether a part is left out.
    """
    return [
        {
            "name": case["name"],
            "objects": objects_of(case),
            "felt": case["felt"] | case.get("felt_by_clients", {}),
            "touch": [*case["felt"], *case.get("felt_by_clients", {})],
            "tells": bool(case["left_out"]) and not case.get("clients_send_all", False),
        }
        for case in CASES
    ]
