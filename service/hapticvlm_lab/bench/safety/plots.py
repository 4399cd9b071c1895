"""The picture of the safety chart."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from hapticvlm.palette import BLUE, GREEN, INK, ORANGE, VERMILION
from hapticvlm.rendering.heat.limits import PLATE_TRIP_HIGH_C
from hapticvlm_lab.bench import figures
from hapticvlm_lab.bench.safety.trials import Off, Row

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SIZE_IN = (13.5, 5.6)
DPI = 110
COLOURS = (GREEN, BLUE, VERMILION, ORANGE)
FAST_S = 0.15
SLOW_S = 1.5


def draw(rows: Sequence[Row], offs: Sequence[Off], source: str, stem: Path) -> list[Path]:
    """Draw peak against false trips, and the time to off, into `stem`.png and .svg; return both."""
    with figures.figure(stem, SIZE_IN, 2, dpi=DPI) as (_, (left, right)):
        _settings(left, rows)
        _times(right, offs, source)
    return figures.files(stem)


def _settings(axes: Axes, rows: Sequence[Row]) -> None:
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
            figures.ring(axes, row.window_ms / 1000.0, row.peak_worst_c)
    figures.level(axes, PLATE_TRIP_HIGH_C, f"{PLATE_TRIP_HIGH_C:g} degC")
    axes.set_xscale("log")
    ticks = sorted({row.window_ms / 1000.0 for row in rows})
    axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    axes.set_xticks([], minor=True)
    axes.set_xlabel("runaway window, s")
    axes.set_ylabel("hottest plate of all, degC (solid)")
    other.set_ylabel("sound plates switched off by mistake, % (dotted)")
    other.grid(visible=False)
    other.set_ylim(-0.5, max(10.0, *(115.0 * row.false_trips for row in rows)))
    knobs = "runaway window and duty cap (ringed: the default)"
    axes.set_title(f"Both plate thermistors frozen while heating:\n{knobs}")
    axes.legend()


def _times(axes: Axes, offs: Sequence[Off], source: str) -> None:
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
        axes.axvline(limit, color=INK, ls="--", lw=1.0)
    axes.set_xlabel("s from the fault to the bridge being off (dashed: 0.15 s and 1.5 s)")
    axes.set_title(f"Time to off\n({source})")
    axes.grid(visible=False, axis="y")
