"""`hapticvlm chart vibration`: what each knob of the synthesis costs, and what a palm loses."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path

from hapticvlm.commands.progress import track
from hapticvlm_lab.bench.printing import made_with, publish
from hapticvlm_lab.bench.vibration import methods, plot
from hapticvlm_lab.bench.vibration.methods import Row
from hapticvlm_lab.bench.vibration.spectra import JND_DB

NAME = "chart-vibration"
EVEN = 1.1  # what costs so little more costs the same: clocks are no finer here
NOTICED_MS = 5.5  # of a tap's delay (docs/physics.md 4.4)


def run(out: Path, *, as_json: bool) -> int:
    """Measure, print a table or JSON, write picture and JSON."""
    knobs = (methods.modes, methods.noises, methods.blocks)
    rows = [row for knob in track(knobs, "measuring three knobs") for row in knob()]
    files = plot.draw(rows, out / NAME, sentence(rows))
    figures = {
        "chart": "vibration",
        **made_with(),
        "jnd_db": JND_DB,
        "default": sentence(rows),
        "rows": [asdict(row) for row in rows],
        "files": [str(path) for path in files],
    }
    return publish(out / f"{NAME}.json", figures, as_json=as_json, show=lambda: _print(rows))


def sentence(rows: Sequence[Row]) -> str:
    """Return for each knob the cheapest method no palm distinguishes, and if it is the default."""
    parts = []
    for knob in ("modes", "noise"):
        good = [row for row in rows if row.knob == knob and row.error_db <= JND_DB]
        best = min(good, key=_rank(good), default=None)
        if best is None:
            parts.append(f"{knob}: none below {JND_DB:g} dB")
        else:
            mine = "default" if best.is_default else "NOT the default"
            parts.append(f"{knob}: {best.value} ({mine})")
    quick = [r for r in rows if r.knob == "block" and r.delay_ms and r.delay_ms < NOTICED_MS]
    quick = [row for row in quick if row.error_db <= JND_DB]
    shown = ", ".join(f"{row.value}{' (default)' if row.is_default else ''}" for row in quick)
    parts.append(f"blocks below {NOTICED_MS:g} ms: {shown or 'none'}")
    return f"cheapest that differ by less than {JND_DB:g} dB: " + "; ".join(parts)


def _rank(rows: Sequence[Row]) -> Callable[[Row], tuple[bool, float]]:
    """Order by cost; the default comes first where it costs as little as any, within EVEN."""
    least_us = min((row.cost_us for row in rows), default=0.0)
    return lambda row: (not (row.is_default and row.cost_us <= EVEN * least_us), row.cost_us)


def _print(rows: Sequence[Row]) -> None:
    print(
        f"{'knob':<6} {'value':<14} {'error dB':>9} {'cost us':>9} {'delay ms':>9} {'core':>7}  at"
    )
    for row in rows:
        delay = "-" if row.delay_ms is None else f"{row.delay_ms:.2f}"
        share = "-" if row.core_share is None else f"{100 * row.core_share:.1f} %"
        mark = " (default)" if row.is_default else ""
        numbers = f"{row.error_db:>9.2f} {row.cost_us:>9.1f} {delay:>9} {share:>7}"
        print(f"{row.knob:<6} {row.value:<14} {numbers}  {row.error_at}{mark}")
    print(sentence(rows))
