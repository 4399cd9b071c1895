"""`hapticvlm chart safety`: the worth of runaway window and duty cap, and the time to off.

A heater whose sensor has come loose goes on heating. Two guards bound what happens then. The
runaway window asks that a plate which is heated gets warmer within so many milliseconds; a short
window trips early, but may trip on a sound plate with a large sink. The duty cap bounds the heating
current, so that a fault does less harm before a guard sees it. The chart shows the hottest plate of
all against the share of sound plates that are switched off by mistake, for each pair of settings.

The guards are the firmware's own core, compiled here; the plate is the one plant model, varied. No
current limit in hardware and no cut-out stand between them: they come on top of what is shown.
"""

from __future__ import annotations

import json
import platform
import tempfile
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hapticvlm import __version__
from hapticvlm.commands.progress import track
from hapticvlm.palette import BLUE, GREEN, INK, ORANGE, VERMILION
from hapticvlm.rendering.heat.limits import PLATE_TRIP_HIGH_C
from hapticvlm_lab.bench import figures
from hapticvlm_lab.bench.printing import publish
from hapticvlm_lab.bench.safety.rig import (
    FULL_SCALE_A,
    INJECTIONS,
    SEED,
    STUCK,
    Core,
    Outcome,
    Setting,
    Variation,
    build,
    draw_plates,
    try_out,
    try_sound,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

NAME = "chart-safety"
WINDOWS_MS = (200, 500, 1000, 2000, 4000)
HEAT_LIMITS_MA = (750, 1500, 3000)
DEFAULT = Setting()

SIZE_IN = (13.5, 5.6)
DPI = 110
COLOURS = (GREEN, BLUE, VERMILION, ORANGE)
FAST_S = 0.15
SLOW_S = 1.5


@dataclass(frozen=True, slots=True)
class Row:
    """One setting over all plates: with frozen thermistors, and false trips of sound plates."""

    window_ms: int
    duty_cap: float
    is_default: bool
    peak_median_c: float
    peak_worst_c: float
    above_trip: float
    false_trips: float
    false_by: dict[str, int]


@dataclass(frozen=True, slots=True)
class Off:
    """The time from a fault until the plate is off; None: never within the trial."""

    fault: str
    off_s: float | None
    guard: str


def run(count: int, out: Path, sweep: Path | None, *, as_json: bool) -> int:
    """Measure `count` plates, print, draw; `sweep` brings the times to off of the compiled binary.

    Raises CoreError, OSError, ValueError for a file that is not a sweep.
    """
    swept = None if sweep is None else read_sweep(sweep)
    plates = draw_plates(count)
    with tempfile.TemporaryDirectory() as place:
        rows = measure(plates, lambda setting: build(setting, Path(place)))
        offs = swept or time_to_off(build(DEFAULT, Path(place)), plates)
    source = "the compiled binary's sweep" if swept else f"the compiled core, worst of {count}"
    files = draw(rows, offs, source, out / NAME)
    report = {
        "chart": "safety",
        "hapticvlm": __version__,
        "python": platform.python_version(),
        "plates": count,
        "seed": SEED,
        "guards": "firmware core compiled for this machine",
        "settings": [asdict(row) for row in rows],
        "time_to_off": {"source": source, "faults": [asdict(off) for off in offs]},
        "files": [str(path) for path in files],
    }
    show = partial(_print, rows, offs, source)
    return publish(out / f"{NAME}.json", report, as_json=as_json, show=show)


def measure(plates: Sequence[Variation], make: Callable[[Setting], Core]) -> list[Row]:
    """Try every setting on every plate."""
    rows = []
    cores_by_limit = {
        heat_limit_ma: {
            setting: make(setting)
            for setting in (Setting(window_ms, heat_limit_ma) for window_ms in WINDOWS_MS)
        }
        for heat_limit_ma in HEAT_LIMITS_MA
    }
    for built in track(cores_by_limit.values(), f"trying {len(plates)} plates at each limit"):
        cores = list(built.values())
        # Windows do not change the course of a plate before they trip, so all of them share a run.
        stuck = [try_out(cores, plate, STUCK) for plate in plates]
        sound = [try_sound(cores, plate) for plate in plates]
        for number, setting in enumerate(built):
            rows.append(
                row(
                    setting,
                    [results[number] for results in stuck],
                    [results[number] for results in sound],
                )
            )
    return rows


def row(setting: Setting, stuck: Sequence[Outcome], sound: Sequence[Outcome]) -> Row:
    """Summarise one setting over all plates."""
    peaks = np.array([outcome.peak_c for outcome in stuck])
    false_by = Counter(name for outcome in sound for name in outcome.faults)
    return Row(
        window_ms=setting.window_ms,
        duty_cap=round(setting.heat_limit_ma / 1000.0 / FULL_SCALE_A, 3),
        is_default=setting == DEFAULT,
        peak_median_c=round(float(np.median(peaks)), 2),
        peak_worst_c=round(float(peaks.max()), 2),
        above_trip=float(np.mean(peaks >= PLATE_TRIP_HIGH_C)),
        false_trips=float(np.mean([bool(outcome.faults) for outcome in sound])),
        false_by=dict(false_by),
    )


def time_to_off(core: Core, plates: Sequence[Variation]) -> list[Off]:
    """Inject each fault into every plate; return the slowest time, and every guard that acted."""
    offs = []
    for injection in INJECTIONS:
        outcomes = [try_out([core], plate, injection)[0] for plate in plates]
        times = [outcome.off_after_s for outcome in outcomes]
        known = [seconds for seconds in times if seconds is not None]
        guards = Counter(name for outcome in outcomes for name in outcome.faults)
        never = len(times) - len(known)
        named = ", ".join(guards) + (f"; not seen {never} times" if never else "")
        offs.append(Off(injection.name, max(known, default=None), named))
    return offs


def read_sweep(path: Path) -> list[Off]:
    """Read what `tests/firmware/sweep.py` printed, slowest situation of each fault.

    Raises ValueError, OSError.
    """
    lines = path.read_text(encoding="utf-8").strip().splitlines()
    try:
        trials = json.loads(lines[-1])["alone"]
        faults = dict.fromkeys(name for trial in trials for name in trial["faults"])
        return [
            _slowest(name, [trial for trial in trials if trial["faults"] == [name]])
            for name in faults
        ]
    except (IndexError, KeyError, TypeError, json.JSONDecodeError) as error:
        raise ValueError(
            f"{path.name} is not the output of tests/firmware/sweep.py: {error!r}"
        ) from None


def _slowest(name: str, trials: Sequence[dict[str, Any]]) -> Off:
    """Return the latest time; a situation in which nothing had to act has none."""
    times = [
        seconds
        for trial in trials
        for seconds in (trial["off_after_s"], trial["cut_out_after_s"])
        if seconds is not None
    ]
    guards = Counter(
        guard for trial in trials for guard in (*trial["caught_by"], *trial["numbers"])
    )
    return Off(name, max(times, default=None), ", ".join(guards))


def _print(rows: Sequence[Row], offs: Sequence[Off], source: str) -> None:
    print("both plate thermistors frozen while heating; false trips on sound plates")
    print(
        f"{'window':>8} {'duty cap':>9} {'peak median':>12} {'worst':>7} {'>= 43':>6} {'false':>6}"
    )
    for row in rows:
        mark = "  default" if row.is_default else ""
        false = ", ".join(f"{name} {count}" for name, count in row.false_by.items())
        print(
            f"{row.window_ms:>5} ms {row.duty_cap:>9.3f} {row.peak_median_c:>9.1f} degC "
            f"{row.peak_worst_c:>7.1f} {row.above_trip:>6.1%} {row.false_trips:>6.1%}"
            f"{mark}  {false}"
        )
    print(f"time to off ({source})")
    for off in offs:
        shown = "never" if off.off_s is None else f"{off.off_s * 1000.0:.0f} ms"
        print(f"  {off.fault:<32} {shown:>9}  {off.guard}")


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
