"""Draws the machine observer's confusion matrices and its recognition against the noise.

Every picture says that the observer is a model, not a person.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hapticvlm.palette import BLUE, GREEN, INK, PURPLE, SOFT, VERMILION

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from hapticvlm_studio.observer.percepts import Noise
    from hapticvlm_studio.observer.predict import PaperCheck, Prediction

DPI = 100
GOAL = 0.95
COLOURS = (BLUE, VERMILION, GREEN, PURPLE)
_MIN_SHARE = 0.005
_LIGHT_FROM = 0.55

_Counts = NDArray[np.int64]


def draw_matrix(prediction: Prediction, path: Path) -> Path:
    """Draw one predicted confusion matrix."""
    size = 2.6 + 0.46 * len(prediction.names)
    figure, axes = _figure(1, (size + 0.6, size))
    _matrix(axes[0], prediction.counts, prediction.names)
    axes[0].set_title(
        f"Machine observer (a model, not a person): {prediction.recognised:.1%} of "
        f"{len(prediction.names)} patterns\n{_noise(prediction.noise)}",
        fontsize=10,
    )
    return _save(figure, path)


def draw_check(check: PaperCheck, people: _Counts, codes: Sequence[str], path: Path) -> Path:
    """Draw the paper's nine people beside the observer calibrated on a set like theirs."""
    figure, axes = _figure(2, (13.0, 7.4))
    _matrix(axes[0], people, codes)
    axes[0].set_title("The paper's nine people, 450 trials", fontsize=10)
    _matrix(axes[1], check.counts, codes)
    axes[1].set_title(
        "Machine observer (a model, not a person) on a set like the paper's,\n"
        f"fitted to the same 84.67 % and 4.2 % of hot-cold slips; order of pairs: rho "
        f"{check.order:.2f}\n{_noise(check.noise)}",
        fontsize=10,
    )
    return _save(figure, path)


def draw_curves(curves: Mapping[str, Sequence[tuple[float, float]]], path: Path) -> Path:
    """Draw recognition against the noise relative to the calibrated one, a line for each set."""
    figure, axes = _figure(1, (7.6, 5.2))
    panel = axes[0]
    for (name, points), colour in zip(curves.items(), COLOURS, strict=False):
        factors, shares = zip(*points, strict=True)
        panel.plot(factors, [100.0 * share for share in shares], "o-", color=colour, label=name)
    panel.axhline(100.0 * GOAL, color=SOFT, ls="--", lw=1.0, label="goal for ten: 95 %")
    panel.axvline(1.0, color=SOFT, ls=":", lw=1.0, label="noise that fits the paper")
    panel.set_xscale("log")
    panel.set_xticks([0.5, 0.7, 1.0, 1.4, 2.0], ["0.5", "0.7", "1", "1.4", "2"])
    panel.minorticks_off()
    panel.set_xlabel("noise relative to the calibrated noise")
    panel.set_ylabel("recognised, %")
    panel.set_ylim(40.0, 101.0)
    panel.set_title("Machine observer (a model, not a person)", fontsize=10)
    panel.grid(alpha=0.3)
    panel.legend(fontsize=9, loc="lower left")
    return _save(figure, path)


def _noise(noise: Noise) -> str:
    return f"noise {noise.touch:.2f} Weber steps of vibration, {noise.heat:.2f} of heat"


def _matrix(axes: Axes, counts: _Counts, names: Sequence[str]) -> None:
    share = counts / counts.sum(axis=1, keepdims=True)
    axes.imshow(share, cmap="Blues", vmin=0.0, vmax=1.0)
    for (row, column), value in np.ndenumerate(share):
        if value >= _MIN_SHARE:
            colour = "white" if value > _LIGHT_FROM else INK
            percent = f"{100.0 * value:.0f}"
            axes.text(column, row, percent, ha="center", va="center", color=colour, fontsize=8)
    axes.set_xticks(range(len(names)), names, rotation=60, ha="right", fontsize=8)
    axes.set_yticks(range(len(names)), names, fontsize=8)
    axes.set_xlabel("answered")
    axes.set_ylabel("presented (cells: % of the row's trials)")


def _figure(columns: int, size: tuple[float, float]) -> tuple[Any, list[Axes]]:
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(
        1, columns, figsize=size, dpi=DPI, layout="constrained", squeeze=False
    )
    return figure, list(axes[0])


def _save(figure: Any, path: Path) -> Path:  # noqa: ANN401 - matplotlib
    from matplotlib import pyplot as plt

    figure.savefig(path, dpi=DPI)
    plt.close(figure)
    return path
