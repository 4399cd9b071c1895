"""`hapticvlm chart vibration`: the cost of each knob of the synthesis, and what a palm loses by it.

Two knobs are turned, each by itself:

- modes of an impact. A struck body rings in damped sines, its modes. The material table keeps only
  the strongest few; the chart asks how many are enough.
- block size. Contacts are taken over between blocks, so a larger block costs less and answers
  later.

The error of a knob is the largest difference that a palm feels, in dB: what the intended vibration
masks, and what is below the threshold, does not count (spectra.felt_difference_db). Costs are the
least of ROUNDS on this process's core, which other work disturbs least; all settings of a knob take
turns.
"""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hapticvlm.commands.progress import track
from hapticvlm.materials import MATERIALS, Mode, Vibration
from hapticvlm.palette import BLUE, GREEN, INK
from hapticvlm.rendering.vibration.impacts import impact
from hapticvlm.rendering.vibration.vibration import RATE_HZ, Motion
from hapticvlm.rendering.vibration.voices import Command, Voices
from hapticvlm_lab.bench import figures
from hapticvlm_lab.bench.printing import publish
from hapticvlm_lab.bench.rigs import K, least_us
from hapticvlm_lab.bench.vibration.spectra import JND_DB, difference_db, event_db, steady_db

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Wave = NDArray[np.float32]

NAME = "chart-vibration"
EVEN = 1.1  # a cost within this factor counts as the same: clocks are no finer here
NOTICED_MS = 5.5  # of a tap's delay (docs/physics.md 4.4)
# A struck body has more modes than the table holds. The missing ones are added in the frequency
# ratios of the glass preset (docs/physics.md 4.3). All modes of a body share one loss factor, so
# the decay of a mode rises in proportion to its frequency; a push of equal force moves a stiff mode
# less, so its amplitude falls in proportion.
RATIOS = (1.0, 1.857, 3.25, 4.946, 6.7, 8.6)
MODES = (1, 2, 3, 4, 6)
SHIPPED = "as shipped"
HIT_MPS = (0.3, 1.0, 5.0)
BLOCKS = (16, 32, 64, 128, 256, 512, 1024)
UPDATES_HZ = 75.0
ROUNDS = 15
DEFAULTS = {"modes": SHIPPED, "block": "128"}

SIZE_IN = (10.0, 4.8)
DPI = 80
LOWEST_DB = 0.02  # a smaller difference is drawn here
PANELS = (  # knob, title, x axis, colour and marker
    ("modes", "modes of an impact", "us a strike", BLUE, "o"),
    ("block", "block size, two rubbing hands", "share of one core, %", GREEN, "D"),
)


@dataclass(frozen=True, slots=True)
class Row:
    """A setting: error in dB and its place, and us a strike or a block; `delay_ms` of a block."""

    knob: str
    value: str
    is_default: bool
    error_db: float
    error_at: str
    cost_us: float
    delay_ms: float | None = None
    core_share: float | None = None


def run(out: Path, *, as_json: bool) -> int:
    """Measure, print a table or JSON, write picture and JSON."""
    knobs = (modes, blocks)
    rows = [row for knob in track(knobs, "measuring both knobs") for row in knob()]
    files = draw(rows, out / NAME, sentence(rows))
    report = {
        "chart": "vibration",
        "jnd_db": JND_DB,
        "default": sentence(rows),
        "rows": [asdict(row) for row in rows],
    }
    return publish(out / NAME, report, files, as_json=as_json, show=lambda: _print(rows))


def sentence(rows: Sequence[Row]) -> str:
    """Name the cheapest number of modes that no palm distinguishes, and every quick block."""
    good = [row for row in rows if row.knob == "modes" and row.error_db <= JND_DB]
    best = min(good, key=_rank(good), default=None)
    modes = "none"
    if best is not None:
        modes = f"{best.value} ({'default' if best.is_default else 'NOT the default'})"
    quick = [r for r in rows if r.knob == "block" and r.delay_ms and r.delay_ms < NOTICED_MS]
    quick = [row for row in quick if row.error_db <= JND_DB]
    blocks = ", ".join(f"{row.value}{' (default)' if row.is_default else ''}" for row in quick)
    return (
        f"cheapest that differ by less than {JND_DB:g} dB: modes: {modes}; "
        f"blocks below {NOTICED_MS:g} ms: {blocks or 'none'}"
    )


def _rank(rows: Sequence[Row]) -> Callable[[Row], tuple[bool, float]]:
    """Order by cost; the default comes first if it costs as little as any, within EVEN."""
    # Without this the clock's noise would decide between two settings of the same cost, and the
    # sentence would change from run to run.
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


def modes() -> list[Row]:
    """Cut every material's row of modes after n of them, and where the table ends it."""
    rows = {name: _whole_row(material.vibration) for name, material in MATERIALS.items()}
    shipped = {name: len(material.vibration.modes) for name, material in MATERIALS.items()}
    counted = {str(count): dict.fromkeys(rows, count) for count in MODES} | {SHIPPED: shipped}
    tables = {
        value: {
            name: replace(full, modes=full.modes[: counts[name]]) for name, full in rows.items()
        }
        for value, counts in counted.items()
    }
    cuts = {(name, len(cut.modes)): cut for table in tables.values() for name, cut in table.items()}
    costs = _least_us({key: partial(_strike, cut) for key, cut in cuts.items()})
    result = []
    for value, table in tables.items():
        errors = {
            f"{name} at {hit:g} m/s": _cut_db(rows[name], cut, hit)
            for name, cut in table.items()
            for hit in HIT_MPS
        }
        cost_us = [costs[name, len(cut.modes)] for name, cut in table.items()]
        result.append(_row("modes", value, errors, float(np.mean(cost_us))))
    return result


def blocks() -> list[Row]:
    """Render two sliding hands in blocks; each contact waits for the next block."""
    meant = steady_db(_moving(1))
    costs = _least_us({size: partial(_two_hands().render, size, 0.0) for size in BLOCKS})
    rows = []
    for size in BLOCKS:
        errors = {"two hands, 75 contacts a second": difference_db(meant, steady_db(_moving(size)))}
        row = _row("block", str(size), errors, costs[size])
        seconds = size / RATE_HZ
        share = costs[size] * 1e-6 / seconds
        rows.append(replace(row, delay_ms=1e3 * seconds, core_share=share))
    return rows


def _row(knob: str, value: str, errors: dict[str, float], cost_us: float) -> Row:
    at = max(errors, key=errors.__getitem__)
    is_default = DEFAULTS[knob] == value
    return Row(knob, value, is_default, round(errors[at], 2), at, round(cost_us, 1))


def _whole_row(vibration: Vibration) -> Vibration:
    """Continue a row beyond the table, up to as many modes as RATIOS has within the band."""
    first = vibration.modes[0]
    known = len(vibration.modes)
    beyond = tuple(
        Mode(first.frequency_hz * ratio, first.decay_per_s * ratio, first.gain / ratio)
        for ratio in RATIOS[known:]
        if first.frequency_hz * ratio <= 1000.0
    )
    return replace(vibration, modes=vibration.modes + beyond)


def _cut_db(full: Vibration, cut: Vibration, speed_mps: float) -> float:
    motion = Motion(speed_mps, 1.0)
    meant, given = (event_db(impact(v, "strike", motion, 0)) for v in (full, cut))
    return difference_db(meant, given)


def _two_hands() -> Voices:
    voices = Voices()
    for hand, name in enumerate(("wood", "rubber")):
        voices.apply(Command(hand, name, "slide", False, Motion(0.2, 2.0), hand, np.inf))
    for _ in range(40):
        voices.render(256, 0.0)
    return voices


def _moving(size: int) -> Wave:
    """Render two hands whose contacts come between blocks of `size`; 1 stands for 8 samples."""
    # A contact takes effect at the start of the next block, so large blocks shift it in time and
    # thin out the updates of a hand that accelerates. Blocks of 8 samples stand for no blocks at
    # all.
    voices = _two_hands()
    step = max(size, 8)
    every = RATE_HZ / UPDATES_HZ
    updates = 0
    waves = []
    for begin in range(0, 4 * RATE_HZ, step):
        while updates * every < begin:
            speed_mps = 0.2 + 0.1 * np.sin(2.0 * np.pi * updates / UPDATES_HZ)
            for hand, name in enumerate(("wood", "rubber")):
                motion = Motion(float(speed_mps), 2.0)
                voices.apply(Command(hand, name, "slide", False, motion, hand, np.inf))
            updates += 1
        waves.append(voices.render(step, 0.0))
    return np.concatenate(waves)


def _strike(body: Vibration) -> Wave:
    return impact(body, "strike", Motion(1.0, 1.0), 0)


def _least_us(works: Mapping[K, Callable[[], object]]) -> dict[K, float]:
    return least_us(works, ROUNDS, times=20)


def draw(rows: Sequence[Row], stem: Path, reason: str) -> list[Path]:
    """Write `stem`.png and .svg; return both."""
    with figures.figure(stem, SIZE_IN, 2, dpi=DPI, sharey=True) as (drawn, panels):
        heading = f"Vibration: {reason}."
        figures.title(drawn, textwrap.fill(heading, 120))
        panels[0].set_ylabel("largest difference that a palm feels, dB")
        for axes, panel in zip(panels, PANELS, strict=True):
            shown = [row for row in rows if row.knob == panel[0]]
            _panel(axes, shown, panel)
            figures.place(
                axes, [(*_at(row), _label(row), INK) for row in shown], [_at(r) for r in shown]
            )
    return figures.files(stem)


def _panel(axes: Axes, rows: Sequence[Row], panel: tuple[str, str, str, str, str]) -> None:
    from matplotlib.ticker import FormatStrFormatter, LogLocator, NullLocator

    _, title, across, colour, marker = panel
    for row in rows:
        axes.plot(*_at(row), marker, color=colour, markersize=7, zorder=4)
        if row.is_default:
            figures.ring(axes, *_at(row))
    figures.level(axes, JND_DB, f"noticeable from {JND_DB:g} dB on", align="left")
    axes.set(xscale="log", yscale="log", title=title, xlabel=across)
    axes.xaxis.set_major_locator(LogLocator(subs=(1, 1.5, 2, 3, 5, 7)))  # hardly a decade wide
    axes.xaxis.set_major_formatter(FormatStrFormatter("%g"))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.margins(x=0.25, y=0.2)


def _at(row: Row) -> tuple[float, float]:
    across = row.cost_us if row.core_share is None else 100.0 * row.core_share
    return across, max(row.error_db, LOWEST_DB)


def _label(row: Row) -> str:
    text = f"{row.value} (default)" if row.is_default else row.value
    return text if row.delay_ms is None else f"{text}, {row.delay_ms:.1f} ms"
