"""Renders `feel.true.json` and `feel.sound.json`, from which a player vibrates without a service.

Each file is complete for one voice. It has short recordings of this synthesis (clips) and the few
tables by which a player picks, scales, loops and mixes them. docs/player.md has the format and the
rules of a player, and `examples/bake_player.py` is the smallest one.

- An impact is rendered at some lengths of contact, at level 1, with the middles of all pulses at
  the same time. So the blend of two neighbours is the impact of a length between theirs. Taps and
  strikes are damped alike and share their clips.
- A texture is a layer or two: a loop of relief, and one of stick-slip, which all materials share. A
  loop is rendered at a centre of REFERENCE_HZ and rms 1. By speed it has a rate, and a gain that
  makes it equally strong for the palm at every rate; by speed and force each layer has a level.
- One grain a material serves for the breaks of carving and for a press.
- The sound voice plays f at TIMES * f + SHIFT_HZ. Only the product follows the rate of a loop, so
  its samples are complex, and the player adds the shift.
- The sound voice is not linear: it compresses the level of all that sounds at once. So its clips
  lack the compression, and the player applies it, with the levels of the true voice (`body`).
- A pad needs no samples. Each clip has its drive, its loudness and its frequency every STEP_S.

The tables come from the same functions that the voices render with. Pure.
"""

from __future__ import annotations

import base64
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import lru_cache, partial
from typing import Annotated, Any, get_args

import msgspec
import numpy as np
from msgspec import Meta
from numpy.typing import NDArray

from hapticvlm import messages
from hapticvlm.materials import Material, Vibration
from hapticvlm.perception import drive_threshold_db
from hapticvlm.rendering.vibration import (
    controller_scale,
    grains,
    impacts,
    loops,
    smoothing,
    sound_voice,
    textures,
    vibration_plan,
    voices,
)
from hapticvlm.rendering.vibration.equaliser import NOMINAL
from hapticvlm.rendering.vibration.loops import Loop
from hapticvlm.rendering.vibration.perceived_level import GRID_HZ
from hapticvlm.rendering.vibration.vibration import IMPACTS, RATE_HZ, Motion

VERSION = 2
STEP_S = 0.0025  # of the tracks that pads play
# Between these, level and rate are linear to within half a dB and two in a hundred.
_USUAL_MPS = tuple(round(0.04 * 2.0 ** (n / 2), 3) for n in range(16))
SPEEDS_MPS = (0.0, 0.01, 0.02, *_USUAL_MPS, 20.0)
FORCES_N = (0.0, 0.2, 0.5, 1.0, 2.0, 4.0, 10.0, 30.0, 200.0)
# Lengths of contact for which impacts are rendered, s: between those of the hardest and of the
# slowest usual one. A press is damped and short, so more of its clips fit.
_BLOWS_S = np.geomspace(impacts.SHORTEST_S, 5.8e-3, 5)
LENGTHS_S = {"tap": _BLOWS_S, "strike": _BLOWS_S, "press": np.geomspace(4.7e-3, 9.8e-3, 7)}
REFERENCE_HZ = 100.0  # centre of a loop of relief at rate 1
PERIODS = {"true": 160, "sound": 30}  # of a loop of relief
_RATES_HZ = (1000, 1500, 2000, 3000, 4000, 6000, 8000)
_ROOM = 3.2  # samples per period of the highest frequency that matters
_ABOVE_DB = {"true": -36.0, "sound": -27.0}  # energy that may lie above it
# Of the peak: the end of a clip that stays below it is cut.
_SILENT = {"true": 1.0 / 200.0, "sound": 1.0 / 60.0}
_FLOOR = 255  # the byte of silence in a track
HUM_HZ = (20.0, 30.0, 40.0, 60.0, 80.0, 120.0, 160.0, 200.0, 250.0, 320.0, 400.0)
SHARES = ("gain", "impact_gain", "hum.level")
_THINNEST_M = 1e-3  # the wire wants more than 0
_CENTRES_HZ = np.geomspace(textures.LOWEST_HZ, textures.HIGHEST_HZ, 8)  # where loops are heard
_JOIN = 8  # periods over which the end of a loop fades into its beginning
_UP_HEARD = 4  # the sound voice ends at 4.3 kHz, far below 6
_FADE = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, RATE_HZ // 1000))  # of a clip of sound, 1 ms

_Floats = NDArray[np.float64]
_Wave = NDArray[Any]  # of float64, or complex

# What a player may assume of each number: with these limits no value of a file can make a loop
# endless or a motor too strong. The schema of the file, by which players refuse one, has them.
_BASE64 = Meta(extra_json_schema={"contentEncoding": "base64"})
Text = Annotated[str, Meta(min_length=1), _BASE64]
# Of a loop four bytes at least: a loop of no sample has no place.
Looped = Annotated[str, Meta(min_length=8), _BASE64]
Share = Annotated[float, Meta(ge=0.0, le=1.0)]
Factor = Annotated[float, Meta(ge=0.0, le=1e4)]
Most = Annotated[float, Meta(ge=1e-4, le=1e4)]  # a pad plays a share of it
Positive = Annotated[float, Meta(ge=1e-4, le=1e6)]
Seconds = Annotated[float, Meta(ge=0.001, le=10.0)]
Step = Annotated[float, Meta(ge=0.001, le=0.005)]
Period = Annotated[float, Meta(ge=0.005, le=0.1)]  # of a plan: a step at least
Hertz = Annotated[float, Meta(ge=1.0, le=1e4)]
Count = Annotated[int, Meta(ge=1, le=1000)]
Rate = Annotated[int, Meta(ge=100, le=96_000)]
Names = Annotated[tuple[str, ...], Meta(min_length=1)]
ClipName = Annotated[str, Meta(extra_json_schema={"in": "clips"})]
LoopName = Annotated[str, Meta(extra_json_schema={"in": "loops"})]
LevelName = Annotated[str, Meta(extra_json_schema={"in": "levels"})]
ByHum = Annotated[tuple[Factor, ...], Meta(min_length=len(HUM_HZ), max_length=len(HUM_HZ))]
BySpeed = Annotated[
    tuple[Factor, ...], Meta(min_length=len(SPEEDS_MPS), max_length=len(SPEEDS_MPS))
]
ByForce = Annotated[tuple[Factor, ...], Meta(min_length=len(FORCES_N), max_length=len(FORCES_N))]
Grid = Annotated[tuple[ByForce, ...], Meta(min_length=len(SPEEDS_MPS), max_length=len(SPEEDS_MPS))]


_RISES = Meta(extra_json_schema={"rises": True})


def _with(*names: str) -> Meta:
    """Return the rule that a table has an entry of each name: a player looks them up."""
    return Meta(extra_json_schema={"required": list(names)})


_BY_FORM = _with(*vibration_plan.PERIOD_S)
_RANGES = _with("speed_mps", "force_n", "thickness_m", *SHARES, "hum.frequency_hz")


class Track(msgspec.Struct, frozen=True):
    """A value every `step_s`: byte b of base64 `bytes` is peak * 10^(-b / 40), 255 is 0."""

    peak: Factor
    bytes: Text


class Clip(msgspec.Struct, frozen=True):
    """One impact or grain at level 1. Signed byte b of base64 `wave` is the sample peak * b / 127.

    Its gain is at most `most`. A pad plays `drive`, its level, `felt`, its loudness, and `hz`, its
    frequency: byte b is 20 * 10^(b / 150) Hz. `body` is the level that the compression of the sound
    voice follows, and null in the true voice.
    """

    rate_hz: Rate
    peak: Factor
    wave: Text
    most: Most
    drive: Track
    felt: Track
    hz: Text
    body: Track | None


class LoopClip(msgspec.Struct, frozen=True):
    """One loop of rms 1; in the sound voice a real and an imaginary byte for each sample.

    By speed it has its gain and rate, and what a pad feels of its drive: the loudness `felt`, as a
    factor, and the frequency `hz`. In the sound voice `loud` is a further gain of the samples, and
    `body` the level that the compression follows.
    """

    rate_hz: Rate
    peak: Factor
    wave: Looped
    drive: Track
    gain: BySpeed
    rate: BySpeed
    felt: BySpeed
    hz: BySpeed
    loud: BySpeed | None
    body: BySpeed | None


class Layer(msgspec.Struct, frozen=True):
    """One loop of a texture. Its level is `factor` times the table of `levels` that it names."""

    loop: LoopName
    level: LevelName
    factor: Factor


class Breaks(msgspec.Struct, frozen=True):
    """The fibres that break under a blade: `per_s` by speed, each a grain of a table's level."""

    level: LevelName
    per_s: BySpeed


class Texture(msgspec.Struct, frozen=True):
    """A texture: its layers, and breaks of fibres."""

    layers: Annotated[tuple[Layer, ...], Meta(min_length=1)]
    breaks: Breaks | None = None


class Impact(msgspec.Struct, frozen=True):
    """An impact: its clips, and its level on a palm and a pad."""

    clips: Annotated[tuple[ClipName, ...], Meta(min_length=1)]
    palm: Factor
    pad: Factor


class MaterialFeel(msgspec.Struct, frozen=True):
    """All of a material. `hz` is its first mode, `again` a grain that soon follows another.

    `thickness_m` is usual of what is swung. `n_per_grain` null: it does not yield.
    """

    hz: Hertz
    tap: Impact
    strike: Impact
    press: Impact
    slide: Texture
    carve: Texture
    swing: Texture
    thickness_m: Positive
    grain: ClipName
    again: ClipName
    n_per_grain: Positive | None


class ImpactTable(msgspec.Struct, frozen=True):
    """By speed and force: the place among the clips, the time of them that is skipped, factors."""

    place: Grid
    skip_s: Grid
    palm: Grid
    pad: Grid


class PadRules(msgspec.Struct, frozen=True):
    """The rules of pads: of a level they play scale[form] * level^exponent, 0 below `min_level`."""

    horizon_s: Annotated[float, Meta(ge=0.1, le=1.0)]  # a period at least
    period_s: Annotated[dict[str, Period], _BY_FORM]
    scale: Annotated[dict[str, Annotated[float, Meta(ge=0.0, le=100.0)]], _BY_FORM]
    exponent: Positive
    min_level: Share
    min_impact: Share
    min_impact_s: Share
    min_amplitude: Share
    hum_hz: Annotated[ByHum, _RISES]
    hum_felt: ByHum


class SoundRules(msgspec.Struct, frozen=True):
    """The compression of the sound voice, and where it moves a hum: times * f + shift_hz."""

    level: Factor
    exponent: Share
    lowest: Positive
    fall_per_s: Factor
    times: Positive
    shift_hz: Factor
    hum_weight: ByHum  # at `pad.hum_hz`


class Rules(msgspec.Struct, frozen=True):
    """The figures of a player that no table holds; docs/player.md says what each is for."""

    lease_s: Seconds
    step_s: Step
    fade_s: Seconds
    smooth_s: Seconds
    ceiling: Annotated[float, Meta(ge=0.01, le=1.0)]
    recover_s: Seconds
    max_impacts: Count
    max_ringing: Count
    max_textures: Count
    level_varies: Annotated[float, Meta(ge=0.0, le=0.5)]
    pitch_varies: Annotated[float, Meta(ge=0.0, le=0.5)]
    grain_strength: Factor
    grains_per_s: Annotated[float, Meta(ge=1.0, le=1000.0)]
    grain_back: Factor
    pad: PadRules
    sound: SoundRules | None


class Feel(msgspec.Struct, frozen=True):
    """A feel file. Grids are [speed][force] at `speeds_mps` and `forces_n`."""

    version: Annotated[int, Meta(ge=VERSION, le=VERSION)]
    voice: Annotated[str, Meta(pattern="^(true|sound)$")]
    ranges: Annotated[dict[str, tuple[Factor, Factor]], _RANGES]
    words: Annotated[dict[str, Names], _with("phase", "hand", "interaction")]
    rules: Rules
    speeds_mps: Annotated[BySpeed, _RISES]
    forces_n: Annotated[ByForce, _RISES]
    impacts: Annotated[dict[str, ImpactTable], _with(*IMPACTS)]
    levels: dict[str, Grid]
    clips: dict[str, Clip]
    loops: dict[str, LoopClip]
    materials: dict[str, MaterialFeel]  # behind the tables whose entries they name


def feel(table: Mapping[str, Material], voice: str) -> Feel:
    """Return the feel of these materials in one of VOICES; some tenths of a second for each new."""
    writer = _Writer(voice, loops={"slips": _slips(voice)})
    materials = {}
    for name, material in sorted(table.items()):
        materials[name], own = _rendered(voice, name, material.vibration)
        writer.clips.update(own.clips)
        writer.loops.update(own.loops)
        writer.levels.update(own.levels)
    return Feel(
        version=VERSION,
        voice=voice,
        ranges=_ranges(),
        words={"phase": get_args(messages.Phase), "hand": get_args(messages.HandName)}
        | {"interaction": get_args(messages.Interaction)},
        rules=_rules(voice),
        speeds_mps=SPEEDS_MPS,
        forces_n=FORCES_N,
        impacts={kind: _impact_table(kind) for kind in IMPACTS},
        levels=writer.levels,
        materials=materials,
        clips=writer.clips,
        loops=writer.loops,
    )


# A folder of scenes is baked in one go, and most of its scenes have the same materials.
@lru_cache(maxsize=64)
def _rendered(voice: str, name: str, facts: Vibration) -> tuple[MaterialFeel, _Writer]:
    writer = _Writer(voice)
    return _material(writer, name, facts), writer


@lru_cache(maxsize=2)
def _slips(voice: str) -> LoopClip:
    writer = _Writer(voice)
    writer.loop("slips", loops.stick_slip(), [textures.slips_hz(speed) for speed in SPEEDS_MPS])
    return writer.loops["slips"]


def encode(file: Feel) -> bytes:
    """Return the contents of a feel file."""
    return msgspec.json.encode(file) + b"\n"


def _ranges() -> dict[str, tuple[float, float]]:
    """Return the range of each quantity that a touch or a surface states, as the wire has it."""
    _, parts = msgspec.json.schema_components((messages.Touch, messages.SceneObject))
    wire = {**parts["Touch"]["properties"], **parts["SceneObject"]["properties"]}
    ranges = {}
    for name in ("speed_mps", "force_n", "thickness_m"):
        part = wire[name].get("anyOf", [wire[name]])[0]
        ranges[name] = float(part.get("minimum", _THINNEST_M)), float(part["maximum"])
    return ranges | dict.fromkeys(SHARES, (0.0, 1.0)) | {"hum.frequency_hz": (1.0, 1000.0)}


def _rules(voice: str) -> Rules:
    edges, weights = sound_voice.EDGES_HZ, sound_voice.WEIGHTS
    sound = SoundRules(
        level=sound_voice.LEVEL,
        exponent=sound_voice.EXPONENT,
        lowest=sound_voice.LOWEST,
        fall_per_s=sound_voice.FALL_PER_S,
        times=sound_voice.TIMES,
        shift_hz=sound_voice.SHIFT_HZ,
        hum_weight=tuple(weights[np.searchsorted(edges, hz, "right") - 1] for hz in HUM_HZ),
    )
    carrier_db = drive_threshold_db(np.array([controller_scale.CARRIER_HZ]))
    pad = PadRules(
        horizon_s=vibration_plan.HORIZON_S,
        period_s={str(form): period for form, period in vibration_plan.PERIOD_S.items()},
        scale={str(form): scale for form, scale in controller_scale.SCALE.items()},
        exponent=controller_scale.EXPONENT,
        min_level=controller_scale.MIN_LEVEL,
        min_impact=controller_scale.MIN_IMPACT,
        min_impact_s=vibration_plan.MIN_IMPACT_S,
        min_amplitude=vibration_plan.MIN_AMPLITUDE,
        hum_hz=HUM_HZ,
        hum_felt=_rounded(10.0 ** ((carrier_db - drive_threshold_db(np.array(HUM_HZ))) / 20.0)),
    )
    return Rules(
        lease_s=messages.LEASE_MS / 1000.0,
        step_s=STEP_S,
        fade_s=voices.FADE_S,
        smooth_s=smoothing.TIME_S,
        ceiling=voices.CEILING,
        recover_s=voices.RELEASE_S,
        max_impacts=voices.MAX_IMPACTS,
        max_ringing=voices.MAX_RINGING,
        max_textures=voices.MAX_FADING_TEXTURES,
        level_varies=impacts.LEVEL_VARIES,
        pitch_varies=impacts.PITCH_VARIES,
        grain_strength=grains.STRENGTH,
        grains_per_s=grains.MAX_RATE_HZ,
        grain_back=grains.BACK,
        pad=pad,
        sound=sound if voice == "sound" else None,
    )


def _impact_table(kind: str) -> ImpactTable:
    strength = partial(impacts.strength, kind)
    lengths = LENGTHS_S[kind]

    def log_length(motion: Motion) -> float:
        return math.log(min(max(impacts.contact_s(kind, motion), lengths[0]), lengths[-1]))

    apart = math.log(lengths[1] / lengths[0])
    return ImpactTable(
        place=_grid(lambda motion: (log_length(motion) - math.log(lengths[0])) / apart),
        skip_s=_grid(lambda motion: _early_s(kind, math.exp(log_length(motion)))),
        palm=_grid(lambda motion: strength(motion) ** impacts.COMPRESSION),
        pad=_grid(strength),
    )


def _early_s(kind: str, contact_s: float) -> float:
    """Return how long before a pulse of this length the longest one begins, s."""
    return max(float(LENGTHS_S[kind][-1] - contact_s), 0.0) / 2.0


def _material(writer: _Writer, name: str, facts: Vibration) -> MaterialFeel:
    grain, on_pad = (
        textures.grain(facts, playback) for playback in (NOMINAL, vibration_plan.PLAYBACK)
    )
    writer.shots([f"{name} grain"], [grain], [on_pad])
    yields = math.isfinite(facts.stiffness)
    again = writer.again(f"{name} grain", grain) if yields else f"{name} grain"
    period_m = facts.swung_m / textures.STROUHAL
    relief = loops.noise(facts.bandwidth, facts.roughness)
    writer.loop(
        f"{name} relief", relief, [textures.centre_hz(v / facts.pitch_m) for v in SPEEDS_MPS]
    )
    air = loops.noise(textures.shed(facts.roughness), 0.0)
    writer.loop(f"{name} air", air, [textures.centre_hz(v / period_m) for v in SPEEDS_MPS])
    return MaterialFeel(
        hz=facts.modes[0].frequency_hz,
        **{kind: _impact(writer, name, kind, facts) for kind in IMPACTS},
        slide=Texture(_layers(writer, name, facts, "slide")),
        carve=_carving(writer, name, facts),
        swing=Texture((writer.layer(f"{name} air", "swing", 1.0, 0.0, 1),)),
        thickness_m=facts.swung_m,
        grain=f"{name} grain",
        again=again,
        n_per_grain=_number(facts.stiffness * grains.STEP_M) if yields else None,
    )


def _impact(writer: _Writer, material: str, kind: str, facts: Vibration) -> Impact:
    """Render an impact at LENGTHS_S, each pulse with its middle at that of the longest one."""
    damping = impacts.DAMPING[kind]
    limits = impacts.leaves_band(facts, damping)
    gains = impacts.log_gains(facts, damping)
    lengths = LENGTHS_S[kind]
    names = [f"{material} {damping:g} {number}" for number in range(lengths.size)]
    if names[0] not in writer.clips:
        waves = []
        for contact_s in lengths:
            level = math.exp(np.interp(math.log(contact_s), np.log(impacts.LENGTHS_S), gains))
            for rate_hz in (RATE_HZ, vibration_plan.PLAN_HZ):
                wave = impacts.struck(facts.modes, contact_s, damping, rate_hz, limits=limits)
                waves.append(np.pad(level * wave, (round(_early_s(kind, contact_s) * rate_hz), 0)))
        writer.shots(names, waves[::2], waves[1::2])
    still = Motion(math.inf, 0.0)  # at full strength
    palm = impacts.level_of(facts, kind, still, NOMINAL.full_scale_db)
    pad = impacts.level_of(facts, kind, still, None)
    return Impact(tuple(names), _number(palm), _number(pad))


def _layers(
    writer: _Writer, material: str, facts: Vibration, kind: str, factor: float = 1.0
) -> tuple[Layer, ...]:
    stick = textures.sticks(facts, kind)
    rubbing = writer.layer(f"{material} relief", "slide", factor * facts.roughness, stick, 1)
    return (rubbing, writer.layer("slips", "slide", factor, stick, 2)) if stick else (rubbing,)


def _carving(writer: _Writer, material: str, facts: Vibration) -> Texture:
    if textures.is_hard(facts):
        return Texture(_layers(writer, material, facts, "carve"))
    spacing_m = textures.BREAK_PERIODS * facts.pitch_m
    per_s = _rounded([textures.breaks_hz(spacing_m, speed) for speed in SPEEDS_MPS])
    breaks = Breaks(writer.level("slide", 0.0, 0), per_s)
    return Texture(_layers(writer, material, facts, "carve", textures.CARVE_RUB), breaks=breaks)


def _as_heard(loop: Loop, periods_hz: float) -> tuple[float, float, float]:
    """Return pitch, strength and held level, in the sound voice, of a loop at this rate."""
    at = np.arange(2 * sound_voice.IN_HZ) * (periods_hz * loop.samples / sound_voice.IN_HZ)
    wave = loop.read(np.asarray(at)).astype(np.float32)
    played = sound_voice.uncompressed(0.1 * wave, _UP_HEARD)
    hertz, power = _spectrum(played, sound_voice.IN_HZ * _UP_HEARD)
    pitch_hz = float(power @ hertz / power.sum())
    return pitch_hz, 100.0 * _strongest(hertz, power), sound_voice.held(wave)


def _spectrum(wave: _Wave, rate_hz: float = RATE_HZ) -> tuple[_Floats, _Floats]:
    """Return frequencies and their mean square in a wave (N,), or in the real part of one."""
    power = np.abs(np.fft.fft(wave)[: wave.size // 2].astype(complex) / wave.size) ** 2
    power *= 0.5 if np.iscomplexobj(wave) else 2.0
    hertz = np.arange(power.size, dtype=np.float64) * (rate_hz / wave.size)
    return hertz, np.asarray(power, np.float64)


def _strongest(hertz: _Floats, power: _Floats) -> float:
    """Return the mean square in the strongest third octave."""
    sums = np.concatenate(([0.0], np.cumsum(power)))
    ends = np.searchsorted(hertz, hertz * 2.0 ** (1.0 / 3.0))
    return float((sums[ends] - sums[:-1]).max())


def _on_pad(wave: _Floats, step: float) -> tuple[float, float]:
    """Return the loudness and the frequency of a loop (N,) that is read at this step."""
    at = np.arange(vibration_plan.PLAN_HZ) * step % wave.size
    played = np.interp(at, np.arange(wave.size + 1), np.append(wave, wave[0]))
    felt = controller_scale.loudness(played.astype(np.float32), vibration_plan.PLAN_HZ)
    share = np.mean(np.diff(played) ** 2) / np.mean(played**2)
    hertz = math.asin(min(math.sqrt(share) / 2.0, 1.0)) * vibration_plan.PLAN_HZ / math.pi
    return float(np.std(felt) / np.std(played)), hertz


@dataclass(slots=True)
class _Writer:
    """Collects the clips and the tables of one voice."""

    voice: str
    clips: dict[str, Clip] = field(default_factory=dict)
    loops: dict[str, LoopClip] = field(default_factory=dict)
    levels: dict[str, Grid] = field(default_factory=dict)

    def level(self, kind: str, stick: float, part: int) -> str:
        """Add the table of one of `textures.strengths` and return its name."""
        name = f"{kind} {part} {stick:g}" if stick else kind
        self.levels[name] = _grid(lambda motion: textures.strengths(kind, 1.0, stick, motion)[part])
        return name

    def layer(self, loop: str, kind: str, factor: float, stick: float, part: int) -> Layer:
        """Return a layer of a texture, whose level is one of `textures.strengths`."""
        return Layer(loop, self.level(kind, stick, part), _number(textures.RMS * factor))

    def shots(self, names: list[str], waves: list[_Floats], pads: list[_Floats]) -> None:
        """Add waves (N,) at RATE_HZ that sound once; `pads` are the same at PLAN_HZ.

        All have the same rate, so that a player can blend them.
        """
        tails = [np.concatenate((wave, np.zeros(RATE_HZ // 50))) for wave in waves]
        voiced = [self._voiced(wave) for wave in tails]
        rate_hz = max(self._rate_hz(wave) for wave in voiced)
        for name, wave, sound, pad in zip(names, waves, voiced, pads, strict=True):
            played = _resampled(sound, round(sound.size * rate_hz / RATE_HZ))
            drive, felt, hertz = _tracks(np.pad(pad, (0, vibration_plan.PLAN_HZ // 50)))
            loudest = np.abs(played).max()
            end = int(np.flatnonzero(np.abs(played) > _SILENT[self.voice] * loudest)[-1])
            self.clips[name] = Clip(
                rate_hz=rate_hz,
                **_packed(played[: end + 1]),
                most=_number(1.0 / float(np.abs(wave).max())),
                drive=_track(drive),
                felt=_track(felt),
                hz=_bytes(np.round(150.0 * np.log10(hertz / 20.0))),
                body=None if self.voice == "true" else _track(_body(wave)),
            )

    def loop(self, name: str, loop: Loop, centres_hz: list[float]) -> None:
        """Add the first periods of a loop, their end joined to their beginning.

        `centres_hz` has, for each of SPEEDS_MPS, the periods a second at which it is read.
        """
        periods = min(PERIODS[self.voice], loop.size // loop.samples - _JOIN)
        wave = _joined(loop, periods)
        relief = _resampled(wave, round(periods / REFERENCE_HZ * RATE_HZ))
        step = round(STEP_S * RATE_HZ)
        rows = relief[: relief.size // step * step].reshape(-1, step)
        centres = np.array(centres_hz)
        on_pad = [_on_pad(wave, loop.samples * hz / vibration_plan.PLAN_HZ) for hz in centres_hz]
        played, loud, body, rates = relief, None, None, centres / REFERENCE_HZ
        if self.voice == "sound":
            line = np.tile(0.1 * relief, 3).astype(np.float32)
            played = 10.0 * sound_voice.unshifted(line)[relief.size : 2 * relief.size]
            hertz, power = _spectrum(played)
            heard = np.array([_as_heard(loop, hz) for hz in _CENTRES_HZ]).T
            turns = (heard[0] - sound_voice.SHIFT_HZ) / float(power @ hertz / power.sum())
            own = [_strongest(hertz * rate + sound_voice.SHIFT_HZ, power) for rate in turns]
            loud = _rounded(np.interp(centres, _CENTRES_HZ, np.sqrt(heard[1] / own)))
            body = _rounded(np.interp(centres, _CENTRES_HZ, heard[2]))
            rates = np.interp(centres, _CENTRES_HZ, turns)
        rate_hz = self._rate_hz(played)
        self.loops[name] = LoopClip(
            rate_hz=rate_hz,
            **_packed(_resampled(played, round(played.size * rate_hz / RATE_HZ))),
            drive=_track(np.sqrt(2.0 * np.mean(rows**2, axis=1))),
            gain=_rounded(np.interp(centres, GRID_HZ, loop.drive)),
            rate=_rounded(rates),
            felt=_rounded([felt for felt, _ in on_pad]),
            hz=_rounded([hertz for _, hertz in on_pad]),
            loud=loud,
            body=body,
        )

    def again(self, name: str, grain: _Floats) -> str:
        """Add what a grain (N,) adds to those before it in a fast press; return its name.

        The sound voice of a sum of grains is not the sum of theirs: this is the nearest for some.
        """
        if self.voice == "true":
            return name
        size, gap = 1 << 13, round(RATE_HZ / grains.MAX_RATE_HZ)
        alone = self._voiced(np.pad(grain, (0, size - grain.size)))
        above, below = np.zeros(size // 2 + 1, complex), np.zeros(size // 2 + 1)
        for count in (2, 3, 4, 8, 16):
            begins = np.zeros(size)
            begins[: count * gap : gap] = 1.0
            added = np.fft.rfft(self._voiced(np.convolve(begins, grain)[:size]) - alone)
            turns = np.fft.rfft(begins) - 1.0
            above += turns.conj() * added / np.sum(np.abs(added) ** 2)
            below += np.abs(turns) ** 2 / np.sum(np.abs(added) ** 2)
        heard = np.fft.irfft(above / (below + 1e-3 * below.max()))[: grain.size + RATE_HZ // 50]
        clip = self.clips[name]
        played = _resampled(heard, round(heard.size * clip.rate_hz / RATE_HZ))
        self.clips[f"{name} again"] = msgspec.structs.replace(clip, **_packed(played))
        return f"{name} again"

    def _voiced(self, wave: _Floats) -> _Floats:
        """Return a wave (N,) that sounds once in this voice."""
        if self.voice == "true":
            return wave
        largest = 10.0 * np.abs(wave).max()  # the voice clips at 1
        sound = sound_voice.uncompressed((wave / largest).astype(np.float32)[:: sound_voice.UP])[
            : wave.size
        ]
        sound[: _FADE.size] *= _FADE
        return np.asarray(sound.astype(np.float64) * largest)

    def _rate_hz(self, wave: _Wave) -> int:
        """Return the lowest rate that holds a wave (N,)."""
        hertz, power = _spectrum(wave)
        above = np.cumsum(power[::-1])[::-1] / power.sum()
        highest_hz = hertz[np.argmax(above < 10.0 ** (_ABOVE_DB[self.voice] / 10.0))]
        return next((rate for rate in _RATES_HZ if rate >= _ROOM * highest_hz), _RATES_HZ[-1])


def _body(wave: _Floats) -> _Floats:
    """Return the rms under the window of the sound voice around each step of a wave (N,)."""
    window = 2 * round(sound_voice.HALF_S * RATE_HZ)
    sums = np.concatenate(([0.0], np.cumsum(np.pad(wave, window // 2) ** 2)))
    means = (sums[window:] - sums[:-window]) / window
    return np.asarray(np.sqrt(means[:: round(STEP_S * RATE_HZ)]))


def _tracks(pad: _Floats) -> tuple[_Floats, _Floats, _Floats]:
    """Return level, loudness and frequency of a wave (N,) at PLAN_HZ for each step, (steps,)."""
    wave = pad.astype(np.float32)
    felt = controller_scale.loudness(wave, vibration_plan.PLAN_HZ)
    drive, loud = (vibration_plan.unlimited_levels(each, STEP_S) for each in (wave, felt))
    hertz = vibration_plan.frequencies(wave, STEP_S)
    end = 1 + int(np.flatnonzero(drive > _SILENT["true"] * drive.max())[-1])
    return drive[:end], loud[:end], hertz[:end]


def _joined(loop: Loop, periods: int) -> _Floats:
    """Return the first periods of a loop, (N,) of rms 1, their end faded into their beginning."""
    count, faded = periods * loop.samples, _JOIN * loop.samples
    wave = loop.wave[:count].copy()
    turn = np.linspace(0.0, 0.5 * np.pi, faded)
    wave[:faded] = wave[:faded] * np.sin(turn) + loop.wave[count : count + faded] * np.cos(turn)
    return np.asarray(wave / np.sqrt(np.mean(wave**2)))


def _resampled(wave: _Wave, count: int) -> _Wave:
    if np.iscomplexobj(wave):  # of the sound voice: its frequencies are positive
        spectrum = np.fft.fft(wave)[: count // 2]
        return np.asarray(np.fft.ifft(spectrum, count) * (count / wave.size))
    return np.asarray(np.fft.irfft(np.fft.rfft(wave), count) * (count / wave.size))


def _grid(value: Callable[[Motion], float]) -> tuple[tuple[float, ...], ...]:
    return tuple(
        tuple(_number(value(Motion(speed, force)), 3) for force in FORCES_N) for speed in SPEEDS_MPS
    )


def _packed(wave: _Wave) -> dict[str, Any]:
    peak = float(np.abs(wave).max())
    numbers = np.ascontiguousarray(wave).view(np.float64)
    samples = np.round(numbers * (127.0 / peak)).astype(np.int8)
    return {"peak": _number(peak), "wave": base64.b64encode(samples.tobytes()).decode("ascii")}


def _track(values: _Floats) -> Track:
    peak = float(values.max())
    decibels = -40.0 * np.log10(np.maximum(values / peak, 1e-9))
    return Track(_number(peak), _bytes(np.round(decibels)))


def _bytes(values: _Floats) -> str:
    data = np.clip(values, 0, _FLOOR).astype(np.uint8)
    return base64.b64encode(data.tobytes()).decode("ascii")


def _rounded(values: _Floats | list[float]) -> tuple[float, ...]:
    return tuple(_number(float(value), 3) for value in values)


def _number(value: float, figures: int = 4) -> float:
    return float(f"{value:.{figures}g}")
