"""The picture of the safety chart."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hapticvlm.rendering.thermal import PLATE_TRIP_HIGH_C

if TYPE_CHECKING:
    from hapticvlm.measure.safety.chart import Off, Row

COLOURS = ("#1b7837", "#2166ac", "#b2182b", "#b35806")
FAST_S, SLOW_S = 0.15, 1.5


def draw(rows: Sequence[Row], offs: Sequence[Off], source: str, path: Path) -> Path:
    """Draw peak against false trips, and the time to off, into one PNG."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    figure, (left, right) = plt.subplots(1, 2, figsize=(13.5, 5.6), layout="constrained")
    _settings(left, rows)
    _times(right, offs, source)
    figure.savefig(path, dpi=110)
    plt.close(figure)
    return path


def _settings(axes: Any, rows: Sequence[Row]) -> None:  # noqa: ANN401 - matplotlib
    caps = sorted({one.duty_cap for one in rows})
    for cap, colour in zip(caps, COLOURS, strict=False):
        line = [one for one in rows if one.duty_cap == cap]
        x, y = [100.0 * one.false_trips for one in line], [one.peak_worst_c for one in line]
        axes.plot(x, y, "o-", color=colour, label=f"duty cap {cap:.0%}", lw=1.2)
        for one, at_x, at_y in zip(line, x, y, strict=True):
            axes.annotate(
                f"{one.window_ms / 1000.0:g} s",
                (at_x, at_y),
                textcoords="offset points",
                xytext=(6, 4),
                fontsize=8,
                color=colour,
            )
            if one.is_default:
                axes.plot(at_x, at_y, "o", ms=15, mfc="none", mec="black", label="default")
    axes.axhline(PLATE_TRIP_HIGH_C, color="grey", ls="--", lw=1.0)
    axes.text(
        1.0,
        PLATE_TRIP_HIGH_C,
        "43 degC",
        ha="right",
        va="bottom",
        fontsize=8,
        color="grey",
        transform=axes.get_yaxis_transform(),
    )
    axes.set_xlabel("sound plates switched off by mistake, %")
    axes.set_ylabel("hottest plate of all, degC")
    axes.set_title("Both plate thermistors frozen while heating:\nrunaway window and duty cap")
    axes.margins(x=0.12)
    axes.legend(fontsize=8)
    axes.grid(alpha=0.3)


def _times(axes: Any, offs: Sequence[Off], source: str) -> None:  # noqa: ANN401
    places = range(len(offs))
    seconds = [off.off_s for off in offs]
    axes.barh(places, [value or 0.0 for value in seconds], color="#4393c3", height=0.6)
    for place, value in zip(places, seconds, strict=True):
        shown = "never" if value is None else f" {value * 1000.0:.0f} ms"
        axes.text(value or FAST_S, place, shown, va="center", fontsize=8)
    axes.set_yticks(places, [off.fault for off in offs], fontsize=8)
    axes.set_xscale("log")
    axes.set_xlim(0.01, max([SLOW_S, *(value for value in seconds if value)]) * 2.5)
    axes.invert_yaxis()
    for limit in (FAST_S, SLOW_S):
        axes.axvline(limit, color="grey", ls="--", lw=1.0)
    axes.set_xlabel("s from the fault to the bridge being off (dashed: 0.15 s and 1.5 s)")
    axes.set_title(f"Time to off\n({source})")
    axes.grid(alpha=0.3, axis="x")
