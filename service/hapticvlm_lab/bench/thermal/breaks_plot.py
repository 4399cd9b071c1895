"""Four of the breaks as a picture: Euler leaves the page, ringing, overflow, windup."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from scipy.special import erfcx

from hapticvlm.palette import BLUE, GREEN, ORANGE, SOFT, VERMILION
from hapticvlm.rendering.heat.contact import thermal_contact
from hapticvlm_lab.bench import figures
from hapticvlm_lab.bench.thermal import breaks, grids
from hapticvlm_lab.bench.thermal.loop import WISH_S, wind_up
from hapticvlm_lab.bench.thermal.methods import Closed, uniform_cells

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SIZE_IN = (12.0, 6.4)
DPI = 80
OURS = GREEN
BAD = VERMILION
OTHER = BLUE


def draw(stem: Path) -> list[Path]:
    """Write `stem`.png and .svg; return both."""
    with figures.figure(stem, SIZE_IN, 4, 2, dpi=DPI) as (_, panels):
        for axes, show in zip(panels, (_euler, _ringing, _overflow, _windup), strict=True):
            with np.errstate(all="ignore"):
                show(axes)
            axes.legend(frameon=False)
    return figures.files(stem)


def _euler(axes: Axes) -> None:
    colours = dict(zip(breaks.BULKS, (OTHER, ORANGE, BAD), strict=True))
    for name, bulk in breaks.BULKS.items():
        contact = thermal_contact(bulk, 22.0, contact_resistance=5e-4)
        errors = breaks.euler_errors(contact, breaks.FRAME_S)
        times = breaks.FRAME_S * np.arange(1, errors.size + 1)
        axes.plot(times, np.clip(errors, 1e-4, 1e7), color=colours[name], label=name)
    axes.axhline(0.1, color=SOFT, linestyle="--", linewidth=0.8, label="what skin feels")
    axes.set(
        title="explicit Euler, 0.1 mm cells, 90 Hz: error", xlabel="s", ylabel="degC (cut at 1e7)"
    )
    axes.set_yscale("log")


def _ringing(axes: Axes) -> None:
    contact = thermal_contact(breaks.ALUMINIUM, 22.0, contact_resistance=breaks.STIFF)
    step_s = breaks.FRAME_S
    methods = (
        ("Crank-Nicolson", BAD, uniform_cells(grids.crank_nicolson)(step_s)),
        ("backward Euler", OTHER, uniform_cells(grids.backward_euler)(step_s)),
        ("closed form (default)", OURS, Closed(step_s)),
    )
    for name, colour, skin in methods:
        followed = breaks.follow(skin, contact, step_s, 0.4)
        times = np.arange(1, followed.size + 1, dtype=np.float64) * step_s
        axes.plot(times[1:], np.diff(followed) / step_s, color=colour, label=name, linewidth=1.2)
    axes.set(
        title="stiff contact with aluminium (R'' 1e-5): rate of the skin",
        xlabel="s",
        ylabel="degC/s",
    )
    axes.set_ylim(-25, 10)


def _overflow(axes: Axes) -> None:
    x = np.geomspace(0.1, 100.0, 400)
    for kind, colour in ((np.float32, BAD), (np.float64, ORANGE)):
        product = breaks.naive(x, kind)
        end = breaks.overflow_at(kind)
        axes.plot(
            x,
            product,
            color=colour,
            linewidth=3,
            alpha=0.6,
            label=f"exp(x^2) erfc(x), {kind.__name__}: ends at {end:.1f}",
        )
        axes.axvline(end, color=colour, linewidth=0.8, linestyle=":")
    axes.plot(x, erfcx(x), color=OURS, linewidth=1.2, label="erfcx(x) (default)")
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_ylim(3e-3, 1.5)
    axes.set(title="the closed form's own pitfall", xlabel="x, grows as sqrt(t) / R''", ylabel="")


def _windup(axes: Axes) -> None:
    for name, guarded, colour in (
        ("without anti-windup", False, BAD),
        ("integral waits (default)", True, OURS),
    ):
        back = wind_up(guarded=guarded)
        axes.plot(back.times_s, back.plate_c, color=colour, label=name)
    axes.axvline(WISH_S, color=SOFT, linewidth=0.8, linestyle=":")
    axes.set(
        title="0 degC asked for 30 s, then neutral: simulated plate", xlabel="s", ylabel="degC"
    )
