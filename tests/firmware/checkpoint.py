"""Saves the results of a sweep, one JSON line per trial, so that it can be interrupted and resumed.

A line is valid only for the firmware, plant and trials that produced it: a different digest of
these starts a new sweep and ignores the old lines.
"""

from __future__ import annotations

import hashlib
import inspect
import json
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from types import ModuleType

from hapticvlm.devices.simulated import plant

from . import board, faults, hardware, rawhost, situations, trials
from .trials import Outcome

MADE_OF: tuple[ModuleType, ...] = (plant, board, faults, hardware, rawhost, situations, trials)


@dataclass(frozen=True)
class Failure:
    """A trial without a result, with the reason."""

    faults: tuple[str, ...]
    situation: str
    reason: str

    is_safe = False


Result = Outcome | Failure
Key = tuple[tuple[str, ...], str]


def key(result: Result) -> Key:
    """Return the identity of a trial."""
    return result.faults, result.situation


def digest(firmware: Path) -> str:
    """Return a digest of a built firmware and the code of the trials."""
    found = hashlib.sha256(firmware.read_bytes())
    found.update((Path(__file__).parent / "sim" / "avrhost.c").read_bytes())
    for module in MADE_OF:
        found.update(inspect.getsource(module).encode())
    return found.hexdigest()[:16]


class Checkpoint:
    """The lines of one file that are valid for one digest."""

    def __init__(self, path: Path, digest: str) -> None:
        self._path, self._digest = path, digest
        path.parent.mkdir(parents=True, exist_ok=True)
        self._lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []

    def outcomes(self) -> Iterable[Outcome]:
        """Yield the results of earlier runs; failures are tried again."""
        for line in self._lines:
            try:
                kept = json.loads(line)
            except json.JSONDecodeError:
                continue  # truncated by an interrupted write
            if kept["digest"] == self._digest and "outcome" in kept:
                yield _outcome(kept["outcome"])

    def keep(self, result: Result) -> None:
        """Write one result at once."""
        kind = "outcome" if isinstance(result, Outcome) else "failure"
        line = json.dumps({"digest": self._digest, kind: asdict(result)})
        with self._path.open("a", encoding="utf-8") as file:
            file.write(line + "\n")


def _outcome(fields: dict[str, object]) -> Outcome:
    """Convert JSON lists back to tuples."""
    values = {name: tuple(it) if isinstance(it, list) else it for name, it in fields.items()}
    return Outcome(**values)  # type: ignore[arg-type]
