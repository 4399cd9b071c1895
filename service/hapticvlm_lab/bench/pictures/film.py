"""Draws a session as pictures of a film: what was seen, what was decided, vibration and plate.

A picture shows the newest frame with the touched object outlined, the decision on it, the last
seconds of plate and vibration, and where on the timeline it is. Pure but for reading the frames.
"""

from __future__ import annotations

import functools
import itertools
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageChops, ImageDraw, ImageFilter, ImageFont

from hapticvlm.demo.show import confidence_text, degrees
from hapticvlm.recordings.timeline import Timeline, TouchSpan
from hapticvlm.rendering.vibration.vibration import RATE_HZ

WIDTH = 960
HEIGHT = 540
_FRAME = 486  # pixels a side
_LEFT = _FRAME + 26
_RIGHT = WIDTH - 22
_BAR_Y = HEIGHT - 34
_PLATE_BOX = (_LEFT, 250, _RIGHT - 64, 350)
_WAVE_BOX = (_LEFT, 396, _RIGHT, 466)
_PLATE_S = 8.0
_WAVE_S = 2.0
_LOW_C = 18.0
_HIGH_C = 40.0
_NEUTRAL_C = 32.0
_OUTLINE_PX = 5
_CARD_SHADE = 0.8
_LEAST_PEAK = 0.25  # of full scale: a weaker session is not drawn as a strong one

GROUND = "#0f1418"
CARD = "#182026"
INK = "#e9eff3"
SOFT = "#a4b2bd"
LINE = "#323f48"
WAVE = "#45d3bf"
SETPOINT = "#7cc0f5"
_WARMTH_C = (14.0, 20.0, 27.0, 32.0, 35.0, 38.0, 42.0)  # the scale of pages/feel.js
_WARMTH = np.array(
    [
        *((24, 76, 176), (46, 132, 218), (128, 190, 230), (214, 200, 178)),
        *((246, 172, 92), (228, 98, 44), (184, 28, 26)),
    ]
)


def pictures(timeline: Timeline, rate_hz: float) -> Iterator[Image.Image]:
    """Yield the film, WIDTH x HEIGHT RGB, this many pictures a second."""
    count = int(timeline.duration_s * rate_hz)
    for number in range(count):
        yield picture(timeline, number / rate_hz)


def picture(timeline: Timeline, t_s: float) -> Image.Image:
    """Draw the moment `t_s`, WIDTH x HEIGHT RGB."""
    sheet = Image.new("RGB", (WIDTH, HEIGHT), GROUND)
    draw = ImageDraw.Draw(sheet)
    touch = timeline.touch_at(t_s)
    _draw_frame(sheet, timeline, t_s, touch)
    _draw_decision(draw, timeline, t_s, touch)
    _draw_plate(draw, timeline, t_s)
    _draw_wave(draw, timeline, t_s)
    _draw_bar(draw, timeline, t_s)
    return sheet


def warmth(celsius: float) -> tuple[int, int, int]:
    """Return the colour of a temperature."""
    return _warmth(round(celsius, 1))


@functools.cache
def _warmth(celsius: float) -> tuple[int, int, int]:
    red, green, blue = (
        round(float(np.interp(celsius, _WARMTH_C, _WARMTH[:, part]))) for part in range(3)
    )
    return red, green, blue


def _draw_frame(
    sheet: Image.Image, timeline: Timeline, t_s: float, touch: TouchSpan | None
) -> None:
    if not timeline.pictures:
        return
    shown = [picture for picture in timeline.pictures if picture.t_s <= t_s]
    newest = (shown or timeline.pictures[:1])[-1]
    is_touched = touch is not None and newest.object_id == touch.object_id
    outline = newest.mask if is_touched else None
    sheet.paste(_frame(newest.file, outline), (12, 12))


@functools.lru_cache(maxsize=4)
def _frame(file: Path, mask: Path | None) -> Image.Image:
    size = (_FRAME, _FRAME)
    frame = Image.open(file).convert("RGB").resize(size, Image.Resampling.LANCZOS)
    if mask is not None:
        shape = Image.open(mask).convert("L").resize(size).point(_is_object)
        grown = shape.filter(ImageFilter.MaxFilter(_OUTLINE_PX))
        frame.paste(WAVE, mask=ImageChops.subtract(grown, shape))
    return frame


def _is_object(value: int) -> int:
    return 255 if value else 0


def _draw_decision(
    draw: ImageDraw.ImageDraw, timeline: Timeline, t_s: float, touch: TouchSpan | None
) -> None:
    if touch is None:
        draw.text((_LEFT, 24), "nothing is touched", SOFT, _font(18))
        return
    draw.text((_LEFT, 24), f"the {touch.hand} hand touches", SOFT, _font(18))
    draw.text((_LEFT, 50), timeline.name(touch.object_id), INK, _font(26))
    decision = timeline.decision_at(t_s, touch.object_id)
    if decision is None:
        return
    colour = SOFT if decision["material"] == "unknown" else WAVE
    draw.text((_LEFT, 92), str(decision["material"]), colour, _font(54))
    draw.text((_LEFT, 160), confidence_text(decision), INK, _font(18))
    draw.text((_LEFT, 186), degrees(decision), SOFT, _font(18))


def _draw_plate(draw: ImageDraw.ImageDraw, timeline: Timeline, t_s: float) -> None:
    left, top, right, _ = _PLATE_BOX
    draw.text((left, top - 26), "plate (simulated)", SOFT, _font(15))
    neutral = _height(_NEUTRAL_C)
    draw.rectangle(_PLATE_BOX, CARD)
    draw.line((left, neutral, right, neutral), LINE)
    draw.text((right + 10, neutral - 9), "32° skin", SOFT, _font(13))
    recent = [sample for sample in timeline.plate if t_s - _PLATE_S <= sample.t_s <= t_s]
    asked = [(_across(sample.t_s, t_s), _height(sample.setpoint_c)) for sample in recent]
    found = [
        (_across(sample.t_s, t_s), sample.plate_c)
        for sample in recent
        if sample.plate_c is not None
    ]
    if len(asked) > 1:
        draw.line(asked, SETPOINT, 1)
    for (from_x, from_c), (to_x, to_c) in itertools.pairwise(found):
        draw.line((from_x, _height(from_c), to_x, _height(to_c)), warmth(to_c), 4)
    if found:
        plate_c = found[-1][1]
        draw.text((right + 10, top - 32), f"{plate_c:.0f}°", warmth(plate_c), _font(26))
        draw.text((left + 130, top - 26), _plate_words(recent[-1].setpoint_c), SETPOINT, _font(15))


def _plate_words(setpoint_c: float) -> str:
    return "" if abs(setpoint_c - _NEUTRAL_C) < 0.05 else f"asked for {setpoint_c:.1f} °C"


def _across(at_s: float, now_s: float) -> float:
    left, _, right, _ = _PLATE_BOX
    return right - (now_s - at_s) / _PLATE_S * (right - left)


def _height(celsius: float) -> float:
    _, top, _, bottom = _PLATE_BOX
    share = (min(max(celsius, _LOW_C), _HIGH_C) - _LOW_C) / (_HIGH_C - _LOW_C)
    return bottom - share * (bottom - top)


def _draw_wave(draw: ImageDraw.ImageDraw, timeline: Timeline, t_s: float) -> None:
    left, top, right, bottom = _WAVE_BOX
    words = "vibration of the palm speaker (height: square root)"
    draw.text((left, top - 26), words, SOFT, _font(15))
    draw.rectangle(_WAVE_BOX, CARD)
    low, high = envelope(timeline.wave, t_s, right - left)
    peak = max(float(np.abs(timeline.wave).max(initial=0.0)), _LEAST_PEAK)
    low, high = visible(low / peak), visible(high / peak)
    middle = (top + bottom) / 2.0
    reach = (bottom - top) / 2.0
    draw.line((left, middle, right, middle), LINE)
    for column in np.flatnonzero(high - low > 1e-3):
        x = left + int(column)
        draw.line((x, middle - high[column] * reach, x, middle - low[column] * reach), WAVE)


def visible(share: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the signed square root: a stroke has a tenth of a blow's height, and is seen too."""
    return np.sign(share) * np.sqrt(np.abs(share))


def card(behind: Image.Image, title: str, line: str) -> Image.Image:
    """Draw a card of a title and a line over a darkened picture, WIDTH x HEIGHT RGB."""
    sheet = Image.blend(behind, Image.new("RGB", behind.size, GROUND), _CARD_SHADE)
    draw = ImageDraw.Draw(sheet)
    draw.text((WIDTH / 2, HEIGHT / 2 - 46), title, INK, _font(58), anchor="mm")
    draw.text((WIDTH / 2, HEIGHT / 2 + 18), line, WAVE, _font(24), anchor="mm")
    return sheet


def envelope(
    wave: NDArray[np.float32], t_s: float, columns: int
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Lowest and highest sample of each column of the last _WAVE_S seconds before `t_s`."""
    size = int(_WAVE_S * RATE_HZ) // columns
    end = int(t_s * RATE_HZ) // size * size  # so that a column keeps its samples as it moves
    begin = end - size * columns
    part = wave[max(begin, 0) : max(end, 0)]
    padded = np.zeros(size * columns, np.float32)
    offset = max(-begin, 0)
    padded[offset : offset + part.size] = part
    rows = padded.reshape(columns, size)
    return rows.min(axis=1), rows.max(axis=1)


def _draw_bar(draw: ImageDraw.ImageDraw, timeline: Timeline, t_s: float) -> None:
    left = 12
    right = WIDTH - 22
    scale = (right - left) / timeline.duration_s
    draw.rectangle((left, _BAR_Y, right, _BAR_Y + 18), CARD)
    for touch in timeline.touches:
        decision = timeline.decision_at(touch.to_s, touch.object_id)
        begin = left + touch.from_s * scale
        end = left + touch.to_s * scale
        draw.rectangle((begin, _BAR_Y, end, _BAR_Y + 18), _setpoint_colour(decision))
    x = left + t_s * scale
    draw.line((x, _BAR_Y - 5, x, _BAR_Y + 23), INK, 2)


def _setpoint_colour(decision: Mapping[str, Any] | None) -> tuple[int, int, int]:
    return warmth(_NEUTRAL_C if decision is None else decision["setpoint_c"])


@functools.cache
def _font(size: int) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    return ImageFont.load_default(size)
