"""Draws a touch as SVG: skin, setpoint and limits over time, the waveform, and its spectrum. Pure.

It needs no library for figures, so that `feel --save` and a notebook draw in every environment. The
waveform of some hundred thousand samples is drawn as its lowest and highest sample per column.
"""

from __future__ import annotations

import html
import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hapticvlm import documents
from hapticvlm.errors import UsageError
from hapticvlm.palette import BLUE, GRID, GROUND, INK, ORANGE, SOFT, VERMILION
from hapticvlm.perception import NEUTRAL_C
from hapticvlm.rendering.heat.limits import SETPOINT_MAX_C, SETPOINT_MIN_C
from hapticvlm.rendering.vibration.vibration import RATE_HZ
from hapticvlm.touches.heat import Heat
from hapticvlm.touches.sound import BAND_HZ, THIRDS, Sound, spectrum, threshold_shape_db

WIDTH_PX, HEIGHT_PX = 880, 540
LOWEST_DB = -90.0
THRESHOLD_LIFT_DB = 5.0  # of the threshold's lowest point over LOWEST_DB: only its shape is known
COLUMNS = 400  # of the waveform
DECADES = (10.0, 100.0, 1000.0)

_Values = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Drawing:
    """A drawing; a notebook shows it. `svg` is its text."""

    svg: str

    def save(self, path: str | Path) -> None:
        """Write it to a .svg file. Raises UsageError for another ending, and OSError."""
        path = Path(path)
        if path.suffix.lower() != ".svg":
            raise UsageError(f"{path}: a drawing is SVG; name a file that ends with .svg")
        documents.replace_file(path, self.svg)

    def _repr_svg_(self) -> str:
        return self.svg


@dataclass(frozen=True, slots=True)
class _Panel:
    """A rectangle of the drawing in px, and the values at its edges."""

    left: float
    top: float
    width: float
    height: float
    x: tuple[float, float]
    y: tuple[float, float]

    def x_px(self, values: ArrayLike) -> _Values:
        share = (np.asarray(values, np.float64) - self.x[0]) / (self.x[1] - self.x[0])
        return np.asarray(self.left + share * self.width)

    def y_px(self, values: ArrayLike) -> _Values:
        share = (np.asarray(values, np.float64) - self.y[0]) / (self.y[1] - self.y[0])
        return np.asarray(self.top + (1.0 - share) * self.height)

    def line(self, x: ArrayLike, y: ArrayLike, colour: str, dash: str = "") -> str:
        pairs = zip(self.x_px(x).tolist(), self.y_px(y).tolist(), strict=True)
        points = " ".join(f"{across:.1f},{down:.1f}" for across, down in pairs)
        dashed = f' stroke-dasharray="{dash}"' if dash else ""
        style = f'fill="none" stroke="{colour}" stroke-width="1.5"{dashed}'
        return f'<polyline points="{points}" {style}/>'

    def level(self, y: float, dash: str) -> str:
        return self.line(self.x, (y, y), SOFT, dash)

    def band(self, begin: float, end: float, colour: str) -> str:
        left, right = self.x_px((begin, end)).tolist()
        place = f'x="{left:.1f}" y="{self.top:g}" width="{right - left:.1f}"'
        return f'<rect {place} height="{self.height:g}" fill="{colour}" fill-opacity="0.1"/>'

    def frame(
        self,
        title: str,
        axes: tuple[str, str],
        ticks: tuple[Sequence[tuple[float, str]], Sequence[tuple[float, str]]],
    ) -> str:
        """Draw the title, the names of the axes, and the grid with its numbers."""
        right, bottom = self.left + self.width, self.top + self.height
        parts = [_text(self.left, self.top - 24, title, INK, size=13)]
        parts.append(_text(right, bottom + 30, axes[0], SOFT, anchor="end"))
        parts.append(_text(self.left - 34, self.top - 8, axes[1], SOFT))
        for value, name in ticks[0]:
            at = float(self.x_px(value))
            parts.append(_rule(at, self.top, at, bottom))
            parts.append(_text(at, bottom + 15, name, SOFT, anchor="middle"))
        for value, name in ticks[1]:
            at = float(self.y_px(value))
            parts.append(_rule(self.left, at, right, at))
            parts.append(_text(self.left - 6, at + 4, name, SOFT, anchor="end"))
        return "".join(parts)

    def legend(self, entries: Sequence[tuple[str, str]]) -> str:
        """Name the lines, (name, colour), above the panel's right end."""
        marks = "".join(
            f'<tspan fill="{colour}" dx="12">— {html.escape(name)}</tspan>'
            for name, colour in entries
        )
        right = self.left + self.width
        return f'<text x="{right:g}" y="{self.top - 8:g}" text-anchor="end">{marks}</text>'


def draw(heat: Heat, sound: Sound) -> Drawing:
    """Draw a touch."""
    name = html.escape(f"A touch of {heat.material}: temperatures, vibration and spectrum")
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH_PX} {HEIGHT_PX}" '
        f'width="{WIDTH_PX}" role="img" aria-label="{name}" '
        'font-family="system-ui, sans-serif" font-size="11" style="max-width: 100%">'
    )
    ground = f'<rect width="{WIDTH_PX}" height="{HEIGHT_PX}" fill="{GROUND}"/>'
    return Drawing(f"{head}{ground}{_heat(heat)}{_wave(sound)}{_spectrum(sound)}</svg>\n")


def _heat(heat: Heat) -> str:
    is_limited = any(by is not None for by in heat.limited_by)
    shown = [*heat.skin_c, *heat.setpoint_c, SETPOINT_MIN_C, SETPOINT_MAX_C, NEUTRAL_C]
    # The setpoint without limits may be far away; it leaves the panel instead of flattening it.
    low, high = min(shown) - 1.0, max(shown) + 1.0
    panel = _Panel(50, 50, 810, 180, (0.0, heat.time_s[-1]), (low, high))
    cue = "" if heat.thermal_cue else "; too close to skin temperature to be felt"
    resistance = f"R'' {heat.contact_resistance:.2g} m2 K/W"
    title = f"{heat.material} at {heat.surface_c:g} degC, {resistance}{cue}"
    parts = [
        panel.frame(title, ("s since contact", "degC"), (_ticks(*panel.x), _ticks(low, high))),
        *(panel.band(begin, end, ORANGE) for begin, end in _limited(heat)),
        panel.level(SETPOINT_MIN_C, "6 4"),
        panel.level(SETPOINT_MAX_C, "6 4"),
        panel.level(NEUTRAL_C, "1 3"),
        panel.line(heat.time_s, heat.skin_c, BLUE),
        panel.line(heat.time_s, heat.setpoint_c, VERMILION),
    ]
    entries = [("skin on the real object", BLUE), ("setpoint of the plate", VERMILION)]
    if is_limited:
        unlimited = np.array(heat.unlimited_c)
        inside = (unlimited >= low) & (unlimited <= high)
        parts.append(
            panel.line(np.array(heat.time_s)[inside], unlimited[inside], ORANGE, dash="2 3")
        )
        names = ", ".join(dict.fromkeys(by for by in heat.limited_by if by is not None))
        entries.append((f"without limits (shaded: limited by {names})", ORANGE))
    return "".join(parts) + panel.legend(entries)


def _limited(heat: Heat) -> list[tuple[float, float]]:
    """Return the runs of time in which a limit acted, (begin, end) in s."""
    pairs = zip(heat.time_s, heat.limited_by, strict=True)
    runs = [(by, [at for at, _ in run]) for by, run in groupby(pairs, key=lambda pair: pair[1])]
    return [(times[0], times[-1]) for by, times in runs if by is not None]


def _wave(sound: Sound) -> str:
    seconds = sound.wave.size / RATE_HZ
    panel = _Panel(50, 310, 360, 180, (0.0, seconds), (-1.05, 1.05))
    columns = np.array_split(sound.wave, min(COLUMNS, sound.wave.size))
    at = (np.arange(len(columns)) + 0.5) * seconds / len(columns)
    lows = [float(column.min()) for column in columns]
    highs = [float(column.max()) for column in columns]
    outline = panel.line([*at, *at[::-1]], [*highs, *lows[::-1]], BLUE)
    motion = f"{sound.motion.speed_mps:g} m/s, {sound.motion.force_n:g} N"
    title = f"vibration: {sound.interaction or 'strike, then slide'} at {motion}"
    ticks = (_ticks(0.0, seconds), _ticks(-1.0, 1.0))
    filled = outline.replace('fill="none"', f'fill="{BLUE}"').replace('"1.5"', '"0.5"')
    return panel.frame(title, ("s", "of full scale"), ticks) + filled


def _spectrum(sound: Sound) -> str:
    levels, inside = spectrum(sound.wave)
    hertz = np.log10(THIRDS)
    panel = _Panel(500, 310, 360, 180, (hertz[0], hertz[-1]), (LOWEST_DB, 5.0))
    shape = np.array(threshold_shape_db())
    lifted = np.minimum(shape - shape.min() + LOWEST_DB + THRESHOLD_LIFT_DB, panel.y[1])
    ticks = ([(math.log10(at), f"{at:g}") for at in DECADES], _ticks(*panel.y))
    return "".join(
        (
            panel.frame("spectrum: dB re full-scale sine, third octaves", ("Hz", "dB"), ticks),
            panel.band(hertz[0], math.log10(BAND_HZ[1]), BLUE),
            panel.line(hertz, lifted, SOFT, dash="5 3"),
            panel.line(hertz, np.maximum(levels, LOWEST_DB), BLUE),
            panel.legend(
                (
                    (f"touch, {100 * inside:.1f} % in 1-1000 Hz", BLUE),
                    ("shape of threshold", SOFT),
                )
            ),
        )
    )


def _ticks(low: float, high: float) -> list[tuple[float, str]]:
    """Return round values, about five, within a range, with their text."""
    rough = (high - low) / 5.0
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(step * power for step in (1.0, 2.0, 5.0, 10.0) if step * power >= rough)
    values = np.arange(math.ceil(low / step), math.floor(high / step + 1e-9) + 1) * step
    return [(value, f"{value:g}") for value in np.round(values, 6).tolist()]


def _rule(x: float, y: float, to_x: float, to_y: float) -> str:
    return f'<path d="M{x:.1f} {y:.1f}L{to_x:.1f} {to_y:.1f}" stroke="{GRID}" stroke-width="0.6"/>'


def _text(
    x: float, y: float, text: str, colour: str, *, anchor: str = "start", size: int = 11
) -> str:
    style = f'fill="{colour}" text-anchor="{anchor}" font-size="{size}"'
    return f'<text x="{x:.1f}" y="{y:.1f}" {style}>{html.escape(text)}</text>'
