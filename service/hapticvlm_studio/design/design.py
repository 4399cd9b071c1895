"""Lays a study out: which patterns are presented to whom and in which order; reads study.json.

A pattern changes how the next one feels: the plate is still warm, the skin has adapted, and the
participant compares. The order is balanced so that this carry-over affects all patterns alike, and
does not make those that happen to come late or after a hot one look worse.

Balanced blocks are Williams designs (1949): n x n Latin squares in which every row is a permutation
of the n patterns, each pattern stands once in every position, and each is preceded once by every
other. Such a square exists for even n. For odd n the square and its mirror image together have the
property, so there are 2 n rows. A block is one row, so each block presents every pattern once.

The price of blocks is that a participant who keeps count can guess the last pattern of a block. A
free order shuffles all trials at once: it has no blocks to count, and no balance beyond chance.
Both are seeded: the same study gives the same orders. study.json is written once, before the first
participant, and holds the orders themselves, so a later version of this program changes nothing.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from hapticvlm import documents
from hapticvlm.errors import shell_word, why_no_folder
from hapticvlm_studio.design import form as forms
from hapticvlm_studio.design.form import NOTHING, Form
from hapticvlm_studio.design.stimuli import Stimulus, StudyError, revive

HEAD = "study.json"
VERSION = 2  # of study.json
# Codes that pandas, R or a spreadsheet reads as a missing value, true or false, a number or a date.
_MONTH = "jan|feb|mar|apr|may|june?|july?|aug|sept?|oct|nov|dec"
_MONTHS = f"{_MONTH}|january|february|march|april|august|september|october|november|december"
_CHANGED_BY_TABLES = re.compile(
    rf"-.*|na|nan|none|null|true|false|t|f|inf|infinity|[\d_-]+|\d[\d_]*[edijl][\d-]*"
    rf"|0x[\da-f]+(p-?\d+)?|\d*-?({_MONTHS})-?\d*",
    re.IGNORECASE,
)
_WINDOWS_DEVICE = re.compile(r"con|prn|aux|nul|(com|lpt)[0-9¹²³]", re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class Design:
    """The patterns of a study, and each participant's trials as names of patterns, in order.

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
        """The codes of the participants, in order."""
        return tuple(self.trials)

    def stimulus(self, name: str) -> Stimulus:
        """Return the pattern of this name. Raises StudyError when there is none."""
        for stimulus in self.stimuli:
            if stimulus.name == name:
                return stimulus
        raise StudyError(f"no pattern {name!r}")


@dataclass(frozen=True, slots=True)
class Plan:
    """The layout of a study: trials per pattern, renderings in training, order, seed and form."""

    repeats: int = 5
    renderings: int = 3
    seed: int = 1
    order: str = "blocked"
    form: Form = NOTHING


def design(stimuli: tuple[Stimulus, ...], participants: Iterable[str], plan: Plan) -> Design:
    """Return the design of a study. Raises StudyError when a code or the plan is invalid."""
    codes = tuple(participants)
    folded = {code.casefold() for code in codes}
    if not codes or len(folded) < len(codes):
        raise StudyError(
            "participants: needs at least one, each with a different code; p1 and P1 are the same "
            "file on Windows and macOS"
        )
    for code in codes:
        check_code(code)
    names = [stimulus.name for stimulus in stimuli]
    lay_out = free_orders if plan.order == "free" else blocked_orders
    rows = lay_out(names, len(codes), plan.repeats, plan.seed)
    trials = dict(zip(codes, rows, strict=True))
    return Design(stimuli, plan.repeats, plan.renderings, plan.seed, trials, plan.order, plan.form)


def check_code(code: str) -> None:
    """Refuse a participant's code that a file or a table cannot hold. Raises StudyError."""
    if not code.replace("-", "").replace("_", "").isalnum() or len(code) > 40:
        raise StudyError(f"participant {code!r}: a code has at most 40 letters, digits, - and _")
    if _CHANGED_BY_TABLES.fullmatch(code):
        raise StudyError(
            f"participant {code!r}: pandas, R or a spreadsheet reads this code as something else; "
            f"use another code, such as P-{code.lstrip('-_')}"
        )
    if _WINDOWS_DEVICE.fullmatch(code):
        raise StudyError(
            f"participant {code!r}: Windows has a device of this name and allows no such file; "
            f"use another code, such as {code}-1"
        )


def write_design(folder: Path, design: Design) -> None:
    """Write study.json. Raises OSError, and the folder then holds none."""
    folder.mkdir(parents=True, exist_ok=True)
    head = {
        "version": VERSION,
        "repeats": design.repeats,
        "renderings": design.renderings,
        "seed": design.seed,
        "order": design.order,
        "patterns": [asdict(stimulus) for stimulus in design.stimuli],
        "trials": design.trials,
        "form": msgspec.to_builtins(design.form),
    }
    text = json.dumps(head, indent=1, ensure_ascii=False) + "\n"
    documents.replace_file(folder / HEAD, text)


class _Versioned(msgspec.Struct):
    version: int


class _Head(msgspec.Struct):
    """The fields of study.json."""

    patterns: list[dict[str, Any]]
    repeats: int
    renderings: int
    seed: int
    trials: dict[str, tuple[str, ...]]
    order: str
    form: dict[str, Any]


def read_design(folder: Path) -> Design:
    """Read study.json. Raises OSError, and StudyError for one that is missing or damaged."""
    path = folder / HEAD
    try:
        content = documents.read_json(path, dict[str, Any])
        version = msgspec.convert(content, _Versioned).version
        if version != VERSION:
            raise StudyError(f"format {version}; this program reads {VERSION}")
        head = msgspec.convert(content, _Head)
        return Design(
            revive(head.patterns, HEAD),
            head.repeats,
            head.renderings,
            head.seed,
            head.trials,
            head.order,
            forms.revive(head.form),
        )
    except (FileNotFoundError, NotADirectoryError):
        if not folder.is_dir():
            raise no_study_folder(folder) from None
        cure = f"`hapticvlm study run {shell_word(folder)}` runs it"
        raise StudyError(f"{folder}: no study was run in this folder; {cure}") from None
    except StudyError as error:
        raise StudyError(f"{path}: {error}") from None
    except ValueError as error:
        raise StudyError(f"{path}: not a study's design ({documents.reason(error)})") from None


def no_study_folder(folder: Path) -> StudyError:
    """Return the error for a path that is not a folder."""
    return StudyError(f"{why_no_folder(folder)}; give the folder of a study")


def square(patterns: int) -> list[list[int]]:
    """Return the rows of a Williams design for n patterns: n rows, or 2 n when n is odd."""
    # The first row goes to and fro: 0, 1, -1, 2, -2 ... modulo n. For even n its steps from entry
    # to entry are all different, and the other rows, which add a constant to it, have the same
    # steps from other starts: so each ordered pair of neighbours occurs exactly once. For odd n
    # each step occurs twice and its negative never; the mirrored rows supply those.
    zigzag = [(i + 1) // 2 if i % 2 else -(i // 2) for i in range(patterns)]
    rows = [[(start + step) % patterns for step in zigzag] for start in range(patterns)]
    return rows if patterns % 2 == 0 else rows + [row[::-1] for row in rows]


def free_orders(
    names: Sequence[str], participants: int, repeats: int, seed: int
) -> list[tuple[str, ...]]:
    """Return each participant's trials, every pattern `repeats` times, shuffled as a whole."""
    rng = np.random.default_rng(seed)
    trials = [name for name in names for _ in range(repeats)]
    return [tuple(trials[at] for at in rng.permutation(len(trials))) for _ in range(participants)]


def blocked_orders(
    names: Sequence[str], participants: int, repeats: int, seed: int
) -> list[tuple[str, ...]]:
    """Return each participant's trials, `repeats` blocks of all patterns.

    Blocks are taken from one square after the other, across participants. Each square has its
    labels and rows shuffled, so participants differ while every n blocks in a row are balanced,
    however many people take part.
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
