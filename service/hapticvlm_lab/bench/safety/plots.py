"""The picture of the safety chart."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from hapticvlm.palette import BLUE, GREEN, ORANGE, VERMILION
from hapticvlm.rendering.plate_limits import PLATE_TRIP_HIGH_C
from hapticvlm_lab.bench.safety.trials import Off, Row

COLOURS = (GREEN, BLUE, VERMILION, ORANGE)
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
    other = axes.twinx()
    caps = sorted({row.duty_cap for row in rows})
    for cap, colour in zip(caps, COLOURS, strict=False):
        line = [row for row in rows if row.duty_cap == cap]
        windows_s = [row.window_ms / 1000.0 for row in line]
        axes.plot(
            windows_s,
            [row.peak_worst_c for row in line],
            "o-",
            color=colour,
            label=f"cap {cap:.0%}",
        )
        other.plot(windows_s, [100.0 * row.false_trips for row in line], ":", color=colour)
    for row in rows:
        if row.is_default:
            at = row.window_ms / 1000.0
            axes.plot(at, row.peak_worst_c, "o", ms=15, mfc="none", mec="black", label="default")
    axes.axhline(PLATE_TRIP_HIGH_C, color="grey", ls="--", lw=1.0, label="43 degC")
    axes.set_xscale("log")
    ticks = sorted({row.window_ms / 1000.0 for row in rows})
    axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    axes.set_xticks([], minor=True)
    axes.set_xlabel("runaway window, s")
    axes.set_ylabel("hottest plate of all, degC (solid)")
    other.set_ylabel("sound plates switched off by mistake, % (dotted)")
    other.set_ylim(-0.5, max(10.0, *(115.0 * row.false_trips for row in rows)))
    axes.set_title("Both plate thermistors frozen while heating:\nrunaway window and duty cap")
    axes.legend(fontsize=8)
    axes.grid(alpha=0.3)


def _times(axes: Any, offs: Sequence[Off], source: str) -> None:  # noqa: ANN401
    places = range(len(offs))
    seconds = [off.off_s for off in offs]
    axes.barh(places, [value or 0.0 for value in seconds], color=BLUE, height=0.6)
    for place, value, off in zip(places, seconds, offs, strict=True):
        shown = "never" if value is None else f" {value * 1000.0:.0f} ms"
        shown += "".join(off.guard.partition(";")[1:])
        axes.text(value or FAST_S, place, shown, va="center", fontsize=8)
    axes.set_yticks(places, [off.fault for off in offs], fontsize=8)
    axes.set_xscale("log")
    axes.set_xlim(0.01, max([SLOW_S, *(value for value in seconds if value)]) * 30.0)
    axes.invert_yaxis()
    for limit in (FAST_S, SLOW_S):
        axes.axvline(limit, color="grey", ls="--", lw=1.0)
    axes.set_xlabel("s from the fault to the bridge being off (dashed: 0.15 s and 1.5 s)")
    axes.set_title(f"Time to off\n({source})")
    axes.grid(alpha=0.3, axis="x")
