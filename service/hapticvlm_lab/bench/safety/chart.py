"""`hapticvlm chart safety`: what runaway window and duty cap are worth, and how fast faults end.

The guards are the firmware's own core, compiled here; the plate is the one plant model, varied. No
current limit in hardware and no cut-out stand between them: they come on top of what is shown.
"""

from __future__ import annotations

import json
import platform
import tempfile
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from hapticvlm import __version__
from hapticvlm.commands.progress import track
from hapticvlm.rendering.heat.limits import PLATE_TRIP_HIGH_C
from hapticvlm_lab.bench.printing import publish
from hapticvlm_lab.bench.safety import plots
from hapticvlm_lab.bench.safety.core import FULL_SCALE_A, Core, Setting, build
from hapticvlm_lab.bench.safety.rig import Outcome
from hapticvlm_lab.bench.safety.trials import INJECTIONS, STUCK, Off, Row, try_out, try_sound
from hapticvlm_lab.bench.safety.variations import SEED, Variation, draw

NAME = "chart-safety"
WINDOWS_MS = (200, 500, 1000, 2000, 4000)
HEAT_LIMITS_MA = (750, 1500, 3000)
DEFAULT = Setting()


def run(count: int, out: Path, sweep: Path | None, *, as_json: bool) -> int:
    """Measure `count` plates, print, draw; `sweep` gives the times to off of the compiled binary.

    Raises CoreError, OSError, ValueError for a sweep that is none.
    """
    swept = None if sweep is None else read_sweep(sweep)
    plates = draw(count)
    with tempfile.TemporaryDirectory() as place:
        rows = measure(plates, lambda setting: build(setting, Path(place)))
        offs = swept or time_to_off(build(DEFAULT, Path(place)), plates)
    source = "the compiled binary's sweep" if swept else f"the compiled core, worst of {count}"
    files = plots.draw(rows, offs, source, out / NAME)
    figures = {
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
    return publish(out / f"{NAME}.json", figures, as_json=as_json, show=show)


def measure(plates: Sequence[Variation], make: Callable[[Setting], Core]) -> list[Row]:
    """Try every setting on every plate."""
    rows = []
    made = {
        heat_limit_ma: {
            setting: make(setting)
            for setting in (Setting(window_ms, heat_limit_ma) for window_ms in WINDOWS_MS)
        }
        for heat_limit_ma in HEAT_LIMITS_MA
    }
    for built in track(made.values(), f"trying {len(plates)} plates at each limit"):
        cores = list(built.values())
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
    """Sum one setting up."""
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
    """Inject each fault into every plate; the slowest, with every guard that acted."""
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
        raise ValueError(f"{path.name} is no sweep: {error!r}") from None


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
