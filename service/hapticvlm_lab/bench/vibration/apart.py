"""Eight materials told apart by the machine observer under one equal stroke, before and after.

`python -m hapticvlm_lab.bench.vibration.apart --out DIR` writes DIR/chart-apart.png. The stroke of
`event.py` is used: a strike, a slide at constant speed, and a slide to and fro. Simulated: a model
of a participant, never a person.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from msgspec.structs import replace

from hapticvlm.materials import MATERIALS
from hapticvlm.palette import BLUE, GREY, INK, SOFT
from hapticvlm.rendering.vibration.vibration import RATE_HZ, motion_at
from hapticvlm.rendering.vibration.voices import Command, Voices
from hapticvlm_lab.bench import figures
from hapticvlm_lab.bench.vibration.event import (
    EIGHT,
    MOTIONS,
    SECONDS,
    Matrix,
    Wave,
    by_speaker,
    taken_for,
)
from hapticvlm_studio.observer.answers import recognised
from hapticvlm_studio.observer.predict import paper_noise

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Measured alike at 0.2.0 (8facd3e), when all materials were levelled to be equally strong.
BEFORE = {"strike": 0.536, "slide": 0.341}
COLOURS = {"before": GREY, "now": BLUE}


def to_and_fro(material: str, _: str, seed: int) -> Wave:
    """Render a slide of the same top speed that goes to and fro, (N,)."""
    peak = MOTIONS["slide"]
    voices = Voices(table={material: MATERIALS[material]}, is_warm=False)
    command = Command(1, material, "slide", False, peak, seed, np.inf)
    blocks = []
    count = 256
    for start in range(0, round(SECONDS * RATE_HZ), count):
        now = start / RATE_HZ
        voices.apply(replace(command, motion=motion_at("slide", peak, now)))
        blocks.append(voices.render(count, now))
    return np.concatenate(blocks).astype(np.float64)


def draw(found: dict[str, Matrix], noise: float, stem: Path) -> None:
    """Draw the shares before and now, and what is taken for what now."""
    with figures.figure(stem, (14.0, 5.0), 3, dpi=90) as (drawn, (bars, *matrices)):
        names = tuple(found)
        _bars(bars, "before", [BEFORE.get(name) for name in names], -0.2)
        _bars(bars, "now", [recognised(found[name]) for name in names], 0.2)
        bars.axhline(100.0 / len(EIGHT), color=SOFT, ls=":", label="chance")
        bars.set(xticks=range(len(names)), xticklabels=names, ylim=(0.0, 100.0))
        bars.set(ylabel="told apart, % of eight materials", title="One equal stroke")
        bars.legend(loc="upper right")
        for axes, name in zip(matrices, ("strike", "slide"), strict=True):
            _matrix(axes, found[name])
            axes.set_title(f"{name}, now: % of each material's trials")
        figures.title(
            drawn, f"Machine observer (simulated, no person), noise {noise:.2f} Weber steps"
        )


def _matrix(axes: Axes, counts: Matrix) -> None:
    share = 100.0 * counts / counts.sum(axis=1, keepdims=True)
    axes.imshow(share, cmap="Blues", vmin=0.0, vmax=100.0)
    axes.grid(visible=False)
    for (row, column), value in np.ndenumerate(share):
        if value >= 0.5:
            colour = "white" if value > 55.0 else INK
            axes.text(column, row, f"{value:.0f}", ha="center", va="center", color=colour)
    axes.set_xticks(range(len(EIGHT)), EIGHT, rotation=45, ha="right")
    axes.set_yticks(range(len(EIGHT)), EIGHT)
    axes.set_xlabel("answered")


def _bars(axes: Axes, label: str, shares: Sequence[float | None], offset: float) -> None:
    known = [(at + offset, 100.0 * share) for at, share in enumerate(shares) if share is not None]
    places, heights = zip(*known, strict=True)
    drawn = axes.bar(places, heights, 0.38, color=COLOURS[label], label=label)
    axes.bar_label(drawn, fmt="%.0f", fontsize=9)


def main() -> None:
    """Measure, draw, and print JSON."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("chart-output"))
    out: Path = parser.parse_args().out
    out.mkdir(parents=True, exist_ok=True)
    noise = paper_noise().touch
    found = {name: taken_for(by_speaker, name, noise) for name in MOTIONS}
    found["slide to and fro"] = taken_for(to_and_fro, "slide", noise)
    draw(found, noise, out / "chart-apart")
    shares = {name: recognised(matrix) for name, matrix in found.items()}
    print(json.dumps({"noise": noise, "before": BEFORE, "now": shares}))


if __name__ == "__main__":
    main()
