"""The cases of `tests/identity_cases.json`, which every client's lookup in a bake has to pass."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

FILE = Path(__file__).parents[1] / "identity_cases.json"
CASES: list[dict[str, Any]] = json.loads(FILE.read_text(encoding="utf-8"))["queries"]


def differences(answers: list[Any]) -> list[tuple[str, Any]]:
    """Return the cases whose answer, [id, surface, by] or the nearest id, is another."""
    pairs = zip(CASES, answers, strict=True)
    return [
        (case["name"], answer)
        for case, answer in pairs
        if answer != (case["found"] or case["nearest"])
    ]
