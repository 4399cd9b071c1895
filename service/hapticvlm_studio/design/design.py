"""What a study presents to whom, and in which order; study.json, which is written once.

Orders are balanced blocks or free. Balanced: Latin squares in which every pattern follows every
other equally often. Williams (1949): the rows of a square of even order n can be chosen so that
each pattern stands once in every place and is preceded once by every other; an odd order needs the
mirrored square beside it. A block is one row, so a block presents each pattern once, and what a
warm plate does to the pattern after it falls on all alike. The end of a block can be guessed by who
keeps count; a free order has no blocks and no balance. Seeded: the same study gives the same
orders.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import msgspec
import numpy as np

from hapticvlm import documents
from hapticvlm_studio.design import form as forms
from hapticvlm_studio.design.form import NOTHING, Form
from hapticvlm_studio.design.stimuli import Stimulus, StudyError, revive

HEAD = "study.json"
# 1 knew no form
VERSION = 2
OLDEST = 1


@dataclass(frozen=True, slots=True)
class Design:
    """What a study presents to whom: patterns, and each participant's trials by pattern name.

    `order` is "blocked" or "free".
    """

    stimuli: tuple[Stimulus, ...]
    repeats: int
    renderings: int
    seed: int
    trials: dict[str, tuple[str, ...]]
    order: str = "blocked"
    form: Form = NOTHING

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
    """How much of it, how often in training, in which orders, and what is asked beside it."""

    repeats: int = 5
    renderings: int = 3
    seed: int = 1
    order: str = "blocked"
    form: Form = NOTHING


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
    return Design(stimuli, plan.repeats, plan.renderings, plan.seed, trials, plan.order, plan.form)


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
        "form": msgspec.to_builtins(made.form),
    }
    unfinished = folder / f"{HEAD}.part"
    with unfinished.open("w", encoding="utf-8") as file:
        file.write(json.dumps(head, indent=1, ensure_ascii=False) + "\n")
        os.fsync(file.fileno())
    unfinished.replace(folder / HEAD)


def read_design(folder: Path) -> Design:
    """Read a study's design back. Raises StudyError."""
    path = folder / HEAD
    try:
        head = documents.parse_json(documents.read_text(path))
        if head["version"] not in range(OLDEST, VERSION + 1):
            raise StudyError(
                f"{path}: format {head['version']}; this program reads {OLDEST} to {VERSION}"
            )
        return Design(
            revive(head["patterns"], HEAD),
            int(head["repeats"]),
            int(head["renderings"]),
            int(head["seed"]),
            {code: tuple(names) for code, names in head["trials"].items()},
            str(head.get("order", "blocked")),
            forms.revive(head.get("form", {})),
        )
    except OSError as error:
        raise StudyError(f"{path}: {error.strerror}; is {folder} a study's folder?") from None
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise StudyError(f"{path}: not a study ({error!r})") from None


def square(patterns: int) -> list[list[int]]:
    """Williams' rows for this many patterns: n rows, or 2 n when n is odd."""
    zigzag = [(i + 1) // 2 if i % 2 else -(i // 2) for i in range(patterns)]
    rows = [[(start + step) % patterns for step in zigzag] for start in range(patterns)]
    return rows if patterns % 2 == 0 else rows + [row[::-1] for row in rows]


def free_orders(
    names: Sequence[str], participants: int, repeats: int, seed: int
) -> list[tuple[str, ...]]:
    """Return each participant's trials: every pattern `repeats` times, shuffled as a whole."""
    rng = np.random.default_rng(seed)
    trials = [name for name in names for _ in range(repeats)]
    return [tuple(trials[at] for at in rng.permutation(len(trials))) for _ in range(participants)]


def orders(
    names: Sequence[str], participants: int, repeats: int, seed: int
) -> list[tuple[str, ...]]:
    """Return each participant's trials in order, `repeats` blocks of all patterns.

    Rows are used up square by square, each square with labels and rows shuffled anew, so that
    every n blocks in a row are balanced, whoever takes part.
    """
    rng = np.random.default_rng(seed)
    blocks: list[tuple[str, ...]] = []
    while len(blocks) < participants * repeats:
        labels = [names[i] for i in rng.permutation(len(names))]
        rows = square(len(names))
        blocks += [tuple(labels[i] for i in rows[at]) for at in rng.permutation(len(rows))]
    return [
        tuple(name for block in blocks[at * repeats : (at + 1) * repeats] for name in block)
        for at in range(participants)
    ]
