"""Draws a touch: skin, setpoint and limits over time, the waveform and its spectrum."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hapticvlm.palette import BLUE, FIGURE, GRID, INK, ORANGE, SOFT, VERMILION
from hapticvlm.perception import NEUTRAL_C
from hapticvlm.rendering.heat.limits import SETPOINT_MAX_C, SETPOINT_MIN_C
from hapticvlm.rendering.vibration.vibration import RATE_HZ
from hapticvlm_studio.touches import sound as sounds
from hapticvlm_studio.touches.heat import Heat
from hapticvlm_studio.touches.sound import BAND_HZ, THIRDS, Sound

if TYPE_CHECKING:
    from matplotlib.axes import Axes

WIDTH_IN = 11.0
HEIGHT_IN = 6.4
DPI = 90
PHYSICS = BLUE
PLATE = VERMILION
LIMITED = ORANGE
LOWEST_DB = -90.0


def draw(heat: Heat, sound: Sound, path: Path) -> None:
    """Write the picture in the format that the ending of `path` names.

    Raises OSError, and ValueError for an unknown ending.
    """
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    with mpl.rc_context(dict(FIGURE)):
        figure, panels = plt.subplot_mosaic(
            [["heat", "heat"], ["wave", "spectrum"]],
            figsize=(WIDTH_IN, HEIGHT_IN),
            dpi=DPI,
            layout="constrained",
        )
        _heat(panels["heat"], heat)
        _wave(panels["wave"], sound)
        _spectrum(panels["spectrum"], sound)
        for axes in panels.values():
            axes.grid(color=GRID, linewidth=0.6)
            axes.set_axisbelow(True)
            axes.spines[["top", "right"]].set_visible(False)
        try:
            figure.savefig(path, dpi=DPI)
        finally:
            plt.close(figure)


def _heat(axes: Axes, heat: Heat) -> None:
    axes.plot(heat.time_s, heat.skin_c, color=PHYSICS, label="skin on the real object")
    axes.plot(heat.time_s, heat.setpoint_c, color=PLATE, label="setpoint of the plate")
    limited = [by is not None for by in heat.limited_by]
    names = ", ".join(dict.fromkeys(by for by in heat.limited_by if by is not None))
    if any(limited):
        axes.plot(
            heat.time_s, heat.unlimited_c, ":", color=LIMITED, label="setpoint without limits"
        )
        low, high = axes.get_ylim()
        axes.fill_between(
            heat.time_s,
            low,
            high,
            where=limited,
            color=LIMITED,
            alpha=0.12,
            label=f"limited by {names}",
            linewidth=0,
        )
    for limit_c in (SETPOINT_MIN_C, SETPOINT_MAX_C):
        axes.axhline(limit_c, color=SOFT, linewidth=0.8, linestyle="--")
    axes.axhline(NEUTRAL_C, color=SOFT, linewidth=0.6, linestyle=":")
    cue = "" if heat.thermal_cue else "; too close to skin temperature to be felt"
    title = f"{heat.material} at {heat.surface_c:g} degC, R'' {heat.contact_resistance:.2g} m2 K/W"
    _name(axes, f"{title}{cue}", "s since contact", "degC (dashed: setpoint limits)")
    axes.legend(frameon=False, fontsize=8)


def _wave(axes: Axes, sound: Sound) -> None:
    times = np.arange(sound.wave.size) / RATE_HZ
    axes.plot(times, sound.wave, color=PHYSICS, linewidth=0.5)
    axes.set_ylim(-1.05, 1.05)
    how = sound.interaction or "strike, then slide"
    motion = f"{sound.motion.speed_mps:g} m/s, {sound.motion.force_n:g} N"
    _name(axes, f"vibration: {how} at {motion}", "s", "of full scale")


def _spectrum(axes: Axes, sound: Sound) -> None:
    levels, inside = sounds.spectrum(sound.wave)
    axes.axvspan(*BAND_HZ, color=PHYSICS, alpha=0.06, linewidth=0, label="1-1000 Hz")
    axes.plot(
        THIRDS,
        np.maximum(levels, LOWEST_DB),
        "-o",
        color=PHYSICS,
        markersize=3,
        label=f"this touch ({100 * inside:.1f} % in the band)",
    )
    shape = np.array(sounds.threshold_shape_db())
    shifted = shape - shape.min() + LOWEST_DB + 5.0
    axes.plot(
        THIRDS,
        shifted,
        "--",
        color=SOFT,
        linewidth=0.9,
        label="shape of the threshold (height depends on the speaker)",
    )
    axes.set_xscale("log")
    axes.set_xlim(THIRDS[0], THIRDS[-1])
    axes.set_ylim(LOWEST_DB - 2.0, 5.0)
    _name(axes, "spectrum, third octaves", "Hz", "dB re full-scale sine")
    axes.legend(frameon=False, fontsize=8, loc="upper left")


def _name(axes: Axes, title: str, x: str, y: str) -> None:
    axes.set_title(title, fontsize=9.5, loc="left", color=INK)
    axes.set_xlabel(x)
    axes.set_ylabel(y)
