"""Builds `feel.json`, from which a player without a service vibrates as the service does.

A player is a port of the voices (voices.py) and of their planner (vibration_plan.py). What can be
worked out before the first touch is in the tables, and every figure that the equations need is in
`rules`; a player has only the equations. So a figure that is tuned here reaches every player with
the next bake, and the golden vectors of `schemas/vectors/feel.json` show whether the equations are
still the same.

What is worked out:

- The levels of impacts. Their computation needs the spectrum of each impact; the table has its
  logarithm at seven lengths of the pulse, between which the service interpolates, too.
- The loops of relief, as samples of 8 bits. A loop has at most `highest` cycles per period, so
  SAMPLES_PER_CYCLE samples for each of these cycles and a cubic through four of them restore it.
- The random numbers. The service draws them from a generator that other languages do not have, so
  the table has the first DRAWS of each of SEEDS seeds. A player repeats them in order.

All numbers are rounded to FIGURES significant digits: the same materials give the same bytes. Pure.
"""

from __future__ import annotations

import base64
import math
from collections.abc import Mapping, Sequence
from typing import get_args

import msgspec
import numpy as np
from numpy.typing import NDArray

from hapticvlm import perception
from hapticvlm.materials import Material, Vibration
from hapticvlm.messages import (
    GENTLE_N,
    LEASE_MS,
    MOST_FORCE_N,
    MOST_SPEED_MPS,
    HandName,
    Interaction,
    Phase,
)
from hapticvlm.rendering.vibration import (
    controller_scale,
    grains,
    hum,
    impacts,
    loops,
    smoothing,
    textures,
    vibration_plan,
    voices,
)
from hapticvlm.rendering.vibration.loops import Loop
from hapticvlm.rendering.vibration.perceived_level import GRID_HZ
from hapticvlm.rendering.vibration.vibration import IMPACTS

VERSION = 1
SEEDS = 32
DRAWS = 64
SAMPLES_PER_CYCLE = 8
FIGURES = 6
_STEPS = 127  # of a sample of 8 bits, either way

_Floats = NDArray[np.float64]
Values = tuple[float, ...]


class LoopTable(msgspec.Struct, frozen=True):
    """One loop of relief. `wave` is base64 of signed bytes, (N,); a byte times `step` is a sample.

    There are `samples` of them in each period of the surface. `drive` is the gain at each of
    `rules.textures.grid_hz` that makes the loop equally strong.
    """

    samples: int
    step: float
    drive: Values
    wave: str


class ModeTable(msgspec.Struct, frozen=True):
    """One decaying mode: its frequency in Hz, its decay in 1/s and its relative gain."""

    frequency_hz: float
    decay_per_s: float
    gain: float


class ImpactTable(msgspec.Struct, frozen=True):
    """The impacts of a material: its modes, and the logarithm of the level of each kind.

    `log_level` has a value for each of `rules.impacts.log_contact_s`.
    """

    modes: tuple[ModeTable, ...]
    log_level: dict[str, Values]


class SlideTable(msgspec.Struct, frozen=True):
    """The relief under a sliding hand: period in m, strength 0..1, and the share that sticks."""

    period_m: float
    roughness: float
    stick: float
    loop: LoopTable


class CarveTable(msgspec.Struct, frozen=True):
    """The part that carving adds: the share that sticks, and the mean distance of fibres, m.

    `fibre_m` is null for a material that is too hard to carve.
    """

    stick: float
    fibre_m: float | None


class SwingTable(msgspec.Struct, frozen=True):
    """The noise of a swung object of the usual thickness, m."""

    thickness_m: float
    loop: LoopTable


class GrainTable(msgspec.Struct, frozen=True):
    """One grain: of a fibre that breaks, or of a press that deepens."""

    frequency_hz: float
    decay_per_s: float
    gain: float


class FeelOfMaterial(msgspec.Struct, frozen=True):
    """All tables of one material. `press_n_per_grain` is null for what does not yield."""

    impact: ImpactTable
    slide: SlideTable
    carve: CarveTable
    swing: SwingTable
    grain: GrainTable
    press_n_per_grain: float | None


class ImpactRules(msgspec.Struct, frozen=True):
    """The figures of impacts.py. `contact_s` and `damping` are by kind of impact.

    A seed varies all frequencies by the share `pitch_varies`, the gain of the first mode by the
    share `gain_varies` and those of the others by `place_db`, each either way.
    """

    contact_s: dict[str, float]
    damping: dict[str, float]
    shortest_s: float
    hard_n: float
    loud_speed_mps: float
    loud_force_n: float
    longest_s: float
    end_fade_s: float
    pitch_varies: float
    gain_varies: float
    place_db: float
    log_contact_s: Values


class TextureRules(msgspec.Struct, frozen=True):
    """The figures of textures.py."""

    rms: float
    lowest_hz: float
    best_hz: float
    highest_hz: float
    bend_hz: float
    slow_speed_mps: float
    light_force_n: float
    slip_m: float
    slips_hz: Values
    stuck_n: float
    catch_mps: float
    strouhal: float
    swing_speed_mps: float
    breaks_hz: Values
    carve_rub: float
    grain_s: float
    grain_contact_s: float
    grid_hz: Values


class PressRules(msgspec.Struct, frozen=True):
    """The figures of grains.py."""

    strength: float
    max_rate_hz: float
    back: float


class VoiceRules(msgspec.Struct, frozen=True):
    """The figures of voices.py and smoothing.py."""

    smooth_s: float
    fade_s: float
    delay_s: float
    release_s: float
    ceiling: float
    chunk: int
    max_ringing: int
    max_impacts: int
    max_fading_textures: int


class PlanRules(msgspec.Struct, frozen=True):
    """The figures of vibration_plan.py and controller_scale.py."""

    rate_hz: int
    horizon_s: float
    period_s: dict[str, float]
    frequency_s: float
    lowest_hz: float
    highest_hz: float
    stale_s: float
    min_impact: float
    min_impact_s: float
    min_amplitude: float
    min_level: float
    exponent: float
    scale: dict[str, float]
    carrier_hz: float


class PerceptionRules(msgspec.Struct, frozen=True):
    """The threshold of the palm, dB at each frequency, and the resonance of the speaker, Hz."""

    threshold_hz: Values
    threshold_db: Values
    resonance_hz: float
    best_hz: float


class TouchRules(msgspec.Struct, frozen=True):
    """What a player takes of a touch: as the protocol's `Touch`; other words are refused."""

    fastest_mps: float
    strongest_n: float
    gentle_n: float
    hand: tuple[str, ...]
    phase: tuple[str, ...]
    interaction: tuple[str, ...]


class Rules(msgspec.Struct, frozen=True):
    """Every figure that the equations of a player need. `lease_s` is how long a touch holds."""

    lease_s: float
    touch: TouchRules
    impacts: ImpactRules
    textures: TextureRules
    press: PressRules
    voices: VoiceRules
    plan: PlanRules
    perception: PerceptionRules


class Feel(msgspec.Struct, frozen=True):
    """The file `feel.json`. `draws` is base64 of little-endian 16-bit numbers, (seeds, draws).

    A draw is its number plus a half, over 65,536. `slips` is the loop of stick-slip, which all
    materials share.
    """

    version: int
    rules: Rules
    seeds: int
    draws: str
    slips: LoopTable
    materials: dict[str, FeelOfMaterial]


def feel(table: Mapping[str, Material]) -> Feel:
    """Return the tables of these materials, which takes some tens of ms for each."""
    return Feel(
        VERSION,
        rules(),
        SEEDS,
        _draws(),
        _loop(loops.stick_slip()),
        {name: _of_material(material.vibration) for name, material in sorted(table.items())},
    )


def encode(tables: Feel) -> bytes:
    """Return the contents of `feel.json`."""
    return msgspec.json.encode(tables) + b"\n"


def rules() -> Rules:
    """Return the figures that a player needs."""
    return Rules(
        LEASE_MS / 1000.0,
        _touch_rules(),
        _impact_rules(),
        _texture_rules(),
        PressRules(grains.STRENGTH, grains.MAX_RATE_HZ, grains.BACK),
        _voice_rules(),
        _plan_rules(),
        PerceptionRules(
            _rounded(perception.THRESHOLD_HZ),
            _rounded(perception.THRESHOLD_DB),
            perception.SPEAKER_RESONANCE_HZ,
            textures.BEST_HZ,
        ),
    )


def left_out(table: Mapping[str, Material]) -> list[str]:
    """Return a sentence for each thing of these materials that a player does otherwise."""
    return [
        f"materials.{name}: its modes ring above the band of touch and players do not filter them; "
        "give it lower or longer modes, or touch it with the service"
        for name, material in sorted(table.items())
        if any(impacts.leaves_band(material.vibration, impacts.DAMPING[kind]) for kind in IMPACTS)
    ]


def hum_drives(tone: hum.Hum) -> Values:
    """Return the amplitude of each harmonic of a hum at level 1, from the fundamental on."""
    return _rounded(np.array(hum.Tone(tone).drives()))


def _of_material(facts: Vibration) -> FeelOfMaterial:
    mode = textures.grain_mode(facts)
    fibre_m = None if textures.is_hard(facts) else textures.BREAK_PERIODS * facts.pitch_m
    yields = math.isfinite(facts.stiffness)
    return FeelOfMaterial(
        _impact(facts),
        SlideTable(
            facts.pitch_m,
            facts.roughness,
            textures.sticks(facts, "slide"),
            _loop(loops.noise(facts.bandwidth, facts.roughness)),
        ),
        CarveTable(_number(textures.sticks(facts, "carve")), fibre_m and _number(fibre_m)),
        SwingTable(facts.swung_m, _loop(loops.noise(textures.shed(facts.roughness), 0.0))),
        GrainTable(mode.frequency_hz, mode.decay_per_s, _number(textures.grain_gain(mode))),
        _number(facts.stiffness * grains.STEP_M) if yields else None,
    )


def _impact(facts: Vibration) -> ImpactTable:
    modes = tuple(ModeTable(m.frequency_hz, m.decay_per_s, m.gain) for m in facts.modes)
    levels = {}
    for kind in IMPACTS:
        full = impacts.full_strength(kind) * impacts.hardness(facts)
        gains = impacts.log_gains(facts, impacts.DAMPING[kind])
        levels[kind] = _rounded(gains + math.log(full))
    return ImpactTable(modes, levels)


def _loop(loop: Loop) -> LoopTable:
    """Pack a loop into as few samples as its highest frequency needs."""
    samples = math.ceil(SAMPLES_PER_CYCLE * loop.highest)
    periods = loop.size // loop.samples
    spectrum = np.fft.rfft(loop.wave[:-1])[: periods * samples // 2 + 1]
    wave = np.fft.irfft(spectrum, periods * samples) * (samples / loop.samples)
    step = _number(float(np.abs(wave).max()) / _STEPS)
    whole = np.clip(np.round(wave / step), -_STEPS, _STEPS).astype(np.int8)
    return LoopTable(samples, step, _rounded(loop.drive), _base64(whole.tobytes()))


def _draws() -> str:
    rows = [np.random.default_rng(seed).random(DRAWS) for seed in range(SEEDS)]
    return _base64(np.floor(np.array(rows) * 65_536.0).astype("<u2").tobytes())


def _touch_rules() -> TouchRules:
    return TouchRules(
        fastest_mps=MOST_SPEED_MPS,
        strongest_n=MOST_FORCE_N,
        gentle_n=GENTLE_N,
        hand=get_args(HandName),
        phase=get_args(Phase),
        interaction=get_args(Interaction),
    )


def _impact_rules() -> ImpactRules:
    return ImpactRules(
        dict(impacts.CONTACT_S),
        dict(impacts.DAMPING),
        impacts.SHORTEST_S,
        impacts.HARD_N,
        impacts.LOUD_SPEED_MPS,
        impacts.LOUD_FORCE_N,
        impacts.LONGEST_IMPACT_S,
        impacts.END_FADE_S,
        impacts.PITCH_VARIES,
        impacts.GAIN_VARIES,
        impacts.PLACE_DB,
        _rounded(np.log(impacts.LENGTHS_S)),
    )


def _texture_rules() -> TextureRules:
    return TextureRules(
        rms=textures.RMS,
        lowest_hz=textures.LOWEST_HZ,
        best_hz=textures.BEST_HZ,
        highest_hz=textures.HIGHEST_HZ,
        bend_hz=textures.BEND_HZ,
        slow_speed_mps=textures.SLOW_SPEED_MPS,
        light_force_n=textures.LIGHT_FORCE_N,
        slip_m=textures.SLIP_M,
        slips_hz=textures.SLIPS_HZ,
        stuck_n=textures.STUCK_N,
        catch_mps=textures.CATCH_MPS,
        strouhal=textures.STROUHAL,
        swing_speed_mps=textures.SWING_SPEED_MPS,
        breaks_hz=textures.BREAKS_HZ,
        carve_rub=textures.CARVE_RUB,
        grain_s=textures.GRAIN_S,
        grain_contact_s=textures.GRAIN_CONTACT_S,
        grid_hz=_rounded(GRID_HZ),
    )


def _voice_rules() -> VoiceRules:
    return VoiceRules(
        smooth_s=smoothing.TIME_S,
        fade_s=voices.FADE_S,
        delay_s=_number(voices.DELAY_S),
        release_s=voices.RELEASE_S,
        ceiling=voices.CEILING,
        chunk=voices.CHUNK,
        max_ringing=voices.MAX_RINGING,
        max_impacts=voices.MAX_IMPACTS,
        max_fading_textures=voices.MAX_FADING_TEXTURES,
    )


def _plan_rules() -> PlanRules:
    return PlanRules(
        rate_hz=vibration_plan.PLAN_HZ,
        horizon_s=vibration_plan.HORIZON_S,
        period_s={str(form): period for form, period in vibration_plan.PERIOD_S.items()},
        frequency_s=vibration_plan.FREQUENCY_S,
        lowest_hz=vibration_plan.LOWEST_HZ,
        highest_hz=vibration_plan.HIGHEST_HZ,
        stale_s=vibration_plan.STALE_S,
        min_impact=controller_scale.MIN_IMPACT,
        min_impact_s=vibration_plan.MIN_IMPACT_S,
        min_amplitude=vibration_plan.MIN_AMPLITUDE,
        min_level=controller_scale.MIN_LEVEL,
        exponent=controller_scale.EXPONENT,
        scale={str(form): scale for form, scale in controller_scale.SCALE.items()},
        carrier_hz=controller_scale.CARRIER_HZ,
    )


def _rounded(values: _Floats | Sequence[float]) -> Values:
    return tuple(_number(float(value)) for value in values)


def _number(value: float) -> float:
    return float(f"{value:.{FIGURES}g}")


def _base64(data: bytes) -> str:
    return base64.b64encode(data).decode("ascii")
