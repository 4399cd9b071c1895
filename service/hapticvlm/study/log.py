"""A study's folder: study.json, said once, and a file of events per participant, only added to.

An event is on the disk (fsync) before anybody acts on it, so a crash loses at most the event that
was being written; its torn line is cut off when the file is opened again.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from hapticvlm.study.stimuli import Stimulus, StudyError, revive
from hapticvlm.study.trials import free_orders, orders

HEAD = "study.json"
VERSION = 1
Event = dict[str, Any]


@dataclass(frozen=True, slots=True)
class Design:
    """What a study presents to whom: patterns, and each participant's trials by pattern name.

    `order` is "blocked" or "free" (trials.py).
    """

    stimuli: tuple[Stimulus, ...]
    repeats: int
    renderings: int
    seed: int
    trials: dict[str, tuple[str, ...]]
    order: str = "blocked"

    @property
    def participants(self) -> tuple[str, ...]:
        """Codes of the participants, in order."""
        return tuple(self.trials)

    def stimulus(self, name: str) -> Stimulus:
        """Return the pattern of this name. Raises StudyError."""
        for stimulus in self.stimuli:
            if stimulus.name == name:
                return stimulus
        raise StudyError(f"no pattern {name!r}")


@dataclass(frozen=True, slots=True)
class Plan:
    """How much of it: repeats of all patterns, renderings of each in training, seed of orders."""

    repeats: int = 5
    renderings: int = 3
    seed: int = 1
    order: str = "blocked"


def design(stimuli: tuple[Stimulus, ...], participants: Iterable[str], plan: Plan) -> Design:
    """Lay a study out. Raises StudyError."""
    codes = tuple(participants)
    if not codes or len(set(codes)) < len(codes):
        raise StudyError("participants: needs at least one, each with a code of its own")
    for code in codes:
        if not code.replace("-", "").replace("_", "").isalnum() or len(code) > 40:
            raise StudyError(f"participant {code!r}: a code has letters, digits, - and _ only")
    names = [stimulus.name for stimulus in stimuli]
    lay = free_orders if plan.order == "free" else orders
    rows = lay(names, len(codes), plan.repeats, plan.seed)
    trials = dict(zip(codes, rows, strict=True))
    return Design(stimuli, plan.repeats, plan.renderings, plan.seed, trials, plan.order)


def write_design(folder: Path, made: Design) -> None:
    """Begin a study; an interrupted write leaves no half file."""
    folder.mkdir(parents=True, exist_ok=True)
    head = {
        "version": VERSION,
        "repeats": made.repeats,
        "renderings": made.renderings,
        "seed": made.seed,
        "order": made.order,
        "patterns": [asdict(stimulus) for stimulus in made.stimuli],
        "trials": made.trials,
    }
    unfinished = folder / f"{HEAD}.part"
    with unfinished.open("w", encoding="utf-8") as file:
        file.write(json.dumps(head, indent=1) + "\n")
        _sync(file.fileno())
    unfinished.replace(folder / HEAD)


def read_design(folder: Path) -> Design:
    """Read a study's design back. Raises StudyError."""
    path = folder / HEAD
    try:
        head = json.loads(path.read_text(encoding="utf-8"))
        if head["version"] != VERSION:
            raise StudyError(f"{path}: version {head['version']}; this program reads {VERSION}")
        return Design(
            revive(head["patterns"]),
            int(head["repeats"]),
            int(head["renderings"]),
            int(head["seed"]),
            {code: tuple(names) for code, names in head["trials"].items()},
            str(head.get("order", "blocked")),
        )
    except OSError as error:
        raise StudyError(f"{path}: {error.strerror}; is {folder} a study's folder?") from None
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise StudyError(f"{path}: not a study ({error!r})") from None


def events(folder: Path, participant: str) -> list[Event]:
    """Read a participant's events; the torn end of a crash is left out. Raises StudyError."""
    path = _path(folder, participant)
    if not path.exists():
        return []
    found = []
    for number, line in enumerate(path.read_bytes().split(b"\n")[:-1], 1):
        try:
            event = json.loads(line)
        except ValueError:
            raise StudyError(f"{path}:{number}: not an event; the file was changed") from None
        if not isinstance(event, dict) or "event" not in event:
            raise StudyError(f"{path}:{number}: not an event; the file was changed")
        found.append(event)
    return found


class Log:
    """One participant's file, open for adding."""

    def __init__(self, folder: Path, participant: str) -> None:
        path = _path(folder, participant)
        self._file = path.open("a+b", buffering=0)
        self._file.seek(0)
        content = self._file.read()
        self._file.truncate(content.rfind(b"\n") + 1)
        _sync(self._file.fileno())

    def add(self, event: Event) -> None:
        """Have one event on the disk before this returns."""
        self._file.write(json.dumps(event).encode() + b"\n")
        _sync(self._file.fileno())

    def close(self) -> None:
        """Close the file."""
        self._file.close()


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Keep a second program from adding to the same study. Raises StudyError."""
    with (folder / ".lock").open("w") as file:
        try:
            import fcntl

            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except ImportError:  # Windows: an open file cannot be replaced there, which must do
            pass
        except OSError:
            raise StudyError(f"{folder}: another `study run` is using it") from None
        yield


def _path(folder: Path, participant: str) -> Path:
    return folder / f"{participant}.jsonl"


def _sync(number: int) -> None:
    os.fsync(number)
