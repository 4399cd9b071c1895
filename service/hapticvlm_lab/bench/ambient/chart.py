"""`hapticvlm chart ambient`: error against seconds and memory, every method to read a temperature.

Without a model of the user's the network has random weights: its seconds and memory are those of
its size, its answers mean nothing, so no error of it is given.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any, Literal

import numpy as np

from hapticvlm.commands.progress import track
from hapticvlm.vlm.contract import Picture
from hapticvlm_lab.bench.ambient import chart_plot, methods
from hapticvlm_lab.bench.ambient.rows import Row, print_rows
from hapticvlm_lab.bench.ambient.timing import measure
from hapticvlm_lab.bench.printing import made_with, publish
from hapticvlm_studio.evaluation.pictures import read_picture, read_pictures
from hapticvlm_studio.evaluation.scores import Guess, Score, constant, score

NAME = "chart-ambient"
SYNTHETIC = 5  # pictures without --data
SIDE = 448  # px, enough for the largest budget
MOST = 60  # pictures of a CSV that are used
RANDOM = "random weights: times and memory are real, answers mean nothing, so no errors"

Size = Literal["tiny", "full"]


@dataclass(frozen=True, slots=True)
class Plan:
    """What to chart: labelled pictures, a model or the size of a random one, an endpoint."""

    data: Path | None
    model: str | None
    size: Size
    device: str
    url: str | None
    token: str | None
    out: Path
    as_json: bool
    budgets: tuple[int, ...] = methods.BUDGETS


def run(plan: Plan) -> int:
    """Chart every method that can be run. Raises LabelledPictureError."""
    pictures, truths = _pictures(plan.data)
    with tempfile.TemporaryDirectory(prefix="hapticvlm-") as folder:
        model = _model(plan, Path(folder))
        asked = [methods.wire(), *methods.in_process(model, plan.device, plan.budgets)]
        if plan.url is not None:
            asked.insert(0, methods.remote(plan.url, plan.model, plan.token))
        rows = [
            _row(method, pictures, truths, is_random=plan.model is None)
            for method in track(asked, "asking each model")
        ]
    rows = [*_blind(truths), *rows]
    note = f"Qwen2-VL, {plan.size}, {RANDOM}" if plan.model is None else plan.model
    files = chart_plot.draw(rows, note, plan.out / NAME)
    figures = _figures(plan, rows, note, len(pictures)) | {"files": [str(path) for path in files]}
    show = partial(print_rows, rows, note)
    return publish(plan.out / f"{NAME}.json", figures, as_json=plan.as_json, show=show)


def _pictures(data: Path | None) -> tuple[list[Picture], list[float] | None]:
    """Read labelled pictures, or draw some whose temperature nobody knows."""
    if data is not None:
        pictures = read_pictures(data)[:MOST]
        return [read_picture(labelled) for labelled in pictures], [
            labelled.truth_c for labelled in pictures
        ]
    rng = np.random.default_rng(3)
    blocks = rng.integers(0, 256, (SYNTHETIC, SIDE // 16, SIDE // 16, 3), dtype=np.uint8)
    return [np.kron(block, np.ones((16, 16, 1), np.uint8)) for block in blocks], None


def _model(plan: Plan, folder: Path) -> str:
    """Name the user's model, or write a random one."""
    if plan.model is not None:
        return plan.model
    from hapticvlm.vlm import contract
    from hapticvlm_lab.bench.ambient import random_model

    asked = contract.about_ambient()
    sizes = random_model.TINY if plan.size == "tiny" else random_model.FULL
    random_model.write(folder, [asked.instruction, *asked.questions], sizes, "bfloat16")
    return str(folder)


def _row(
    method: methods.Method,
    pictures: Sequence[Picture],
    truths: Sequence[float] | None,
    *,
    is_random: bool,
) -> Row:
    print(f"{method.name} ...", file=sys.stderr, flush=True)
    timed = measure(method, pictures)
    if isinstance(timed, str):
        return Row(method.name, method.family, method.is_default, None, None, timed)
    means_something = method.family != "wire" and not (is_random and method.family != "remote")
    graded = _grade(timed.guesses, truths) if means_something else None
    return Row(method.name, method.family, method.is_default, timed, graded, None)


def _grade(guesses: Sequence[Guess | None], truths: Sequence[float] | None) -> Score | None:
    if truths is None:
        return None
    answered = [(guess, truth) for guess, truth in zip(guesses, truths, strict=True) if guess]
    return score([guess for guess, _ in answered], [truth for _, truth in answered])


def _blind(truths: Sequence[float] | None) -> list[Row]:
    """Rows of what asks no model: constants, which take no time."""
    rows = []
    for rule in ("default", "leave-one-out median"):
        found = None if truths is None else constant(rule, truths)
        graded = None if found is None or truths is None else score(found, truths)
        why = None if graded else "no labelled pictures: --data"
        rows.append(Row(f"constant: {rule}", "constant", False, None, graded, why))
    return rows


def _figures(plan: Plan, rows: Sequence[Row], note: str, pictures: int) -> dict[str, Any]:
    return {
        "chart": "ambient",
        **made_with(),
        "device": plan.device,
        "model": note,
        "weights": "random" if plan.model is None else "given",
        "pictures": pictures,
        "rows": [_flat(row) for row in rows],
    }


def _flat(row: Row) -> dict[str, Any]:
    figures = asdict(row)
    if row.timed is not None:
        del figures["timed"]["guesses"]
        figures["timed"]["answered"] = row.answered
    return figures
