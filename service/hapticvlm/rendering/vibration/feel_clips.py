"""Renders `feel.true.json` and `feel.sound.json`, from which a player vibrates without a service.

Each file is complete for one voice. It has short recordings of this synthesis (clips) and the few
tables by which a player picks, scales, loops and mixes them. docs/player.md has the format and the
rules of a player, and `examples/bake_player.py` is the smallest one.

- An impact is rendered at three lengths of contact, at level 1. The one of the nearest length is
  played at the level that speed and force give.
- A texture is a layer or two: a loop of relief, and one of stick-slip, which all materials share. A
  loop is rendered at a centre of REFERENCE_HZ and rms 1. By speed it has a rate, and a gain that
  makes it equally strong for the palm at every rate; by speed and force each layer has a level.
- One grain a material serves for the breaks of carving and for a press.
- The sound voice is not linear: it compresses the level of all that sounds at once. So its clips
  lack the compression, and the player applies it, with the levels of the true voice (`body`).
- A pad needs no samples. Each clip has its drive, its loudness and its frequency every STEP_S.

The tables come from the same functions that the voices render with. Pure.
"""

from __future__ import annotations

import base64
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Any, get_args

import msgspec
import numpy as np
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
# Between these, level and rate are linear to within half a dB and three in a hundred.
SPEEDS_MPS = (0.0, 0.01, 0.03, 0.07, 0.12, 0.2, 0.35, 0.6, 1.0, 1.5, 2.2, 3.2, 5.0, 8.0, 20.0)
FORCES_N = (0.0, 0.2, 0.5, 1.0, 2.0, 4.0, 10.0, 30.0, 200.0)
LENGTHS = 3  # of contact, for which an impact is rendered
_SPREAD = (0.1, 0.5, 0.9)  # where they lie among those of usual motions
_USUAL = [Motion(v, f) for v in (0.1, 0.2, 0.35, 0.6, 1.0, 1.5) for f in (0.5, 1.5, 5.0)]
REFERENCE_HZ = 100.0  # centre of a loop of relief at rate 1
PERIODS = {"true": 160, "sound": 42}  # of a loop of relief
_RATES_HZ = {"true": (1000, 1500, 2000, 3000, 4000), "sound": (4000, 6000, 8000, 12000)}
_ROOM = 3.2  # samples per period of the highest frequency that matters
_ABOVE_DB = {"true": -36.0, "sound": -27.0}  # energy that may lie above it
_SILENT = {
    "true": 1.0 / 200.0,
    "sound": 1.0 / 60.0,
}  # of the peak: the end of a clip that stays below it is cut
_FLOOR = 255  # the byte of silence in a track
FIGURES = 4
_THINNEST_M = 1e-3  # the wire wants more than 0
_JOIN = 8  # periods over which the end of a loop fades into its beginning
_FADE = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, RATE_HZ // 1000))  # of a clip of sound, 1 ms

_Floats = NDArray[np.float64]
Values = tuple[float, ...]
Grid = tuple[Values, ...]


class Track(msgspec.Struct, frozen=True):
    """A value every `step_s`: byte b of base64 `bytes` is peak * 10^(-b / 40), 255 is 0."""

    peak: float
    bytes: str


class Clip(msgspec.Struct, frozen=True):
    """One impact or grain at level 1. Signed byte b of base64 `wave` is the sample peak * b / 127.

    Its gain is at most `most`. A pad plays `drive`, its level, `felt`, its loudness, and `hz`, its
    frequency: byte b is 20 * 10^(b / 150) Hz. `body` is the level that the compression of the sound
    voice follows, and null in the true voice.
    """

    rate_hz: int
    peak: float
    wave: str
    most: float
    drive: Track
    felt: Track
    hz: str
    body: Track | None


class LoopClip(msgspec.Struct, frozen=True):
    """One loop of rms 1. By speed: its gain, and the rates of its tracks and of its samples.

    What a pad feels of its drive has the loudness `felt`, as a factor, and the frequency `hz`.
    """

    rate_hz: int
    peak: float
    wave: str
    drive: Track
    body: Track | None
    gain: Values
    rate: Values
    wave_rate: Values
    felt: Values
    hz: Values


class Layer(msgspec.Struct, frozen=True):
    """One loop of a texture. Its level is by speed and force."""

    loop: str
    level: Grid


class Texture(msgspec.Struct, frozen=True):
    """A texture: its layers, and the usual thickness of what is swung, m."""

    layers: tuple[Layer, ...]
    thickness_m: float | None = None


class Carving(msgspec.Struct, frozen=True):
    """Carving as it differs from sliding: the layers, their factor, and the breaks of fibres.

    `layers` null: those of sliding. There are `per_s` breaks by speed, each a grain of `level`.
    """

    layers: tuple[Layer, ...] | None
    factor: float
    level: Grid | None
    per_s: Values | None


class Impact(msgspec.Struct, frozen=True):
    """An impact: its clips, their lengths of contact in s, and its level on a palm and a pad."""

    clips: tuple[str, ...]
    contact_s: Values
    palm: float
    pad: float


class MaterialFeel(msgspec.Struct, frozen=True):
    """All of a material. `hz` is its first mode; `n_per_grain` null: it does not yield."""

    hz: float
    tap: Impact
    strike: Impact
    press: Impact
    slide: Texture
    carve: Carving
    swing: Texture
    grain: str
    n_per_grain: float | None


class ImpactTable(msgspec.Struct, frozen=True):
    """By speed and force: the length of contact in s, and the factor of palm and pad."""

    contact_s: Grid
    palm: Grid
    pad: Grid


class PadRules(msgspec.Struct, frozen=True):
    """The rules of pads: of a level they play scale[form] * level^exponent, 0 below `min_level`."""

    horizon_s: float
    period_s: dict[str, float]
    scale: dict[str, float]
    exponent: float
    min_level: float
    min_impact: float
    min_impact_s: float
    min_amplitude: float
    hum_hz: Values
    hum_felt: Values


class SoundRules(msgspec.Struct, frozen=True):
    """The compression of the sound voice, and where it moves a hum: times * f + shift_hz."""

    level: float
    exponent: float
    lowest: float
    fall_per_s: float
    times: float
    shift_hz: float
    hum_weight: Values  # at `pad.hum_hz`


class Rules(msgspec.Struct, frozen=True):
    """The figures of a player that no table holds; docs/player.md says what each is for."""

    lease_s: float
    step_s: float
    fade_s: float
    smooth_s: float
    ceiling: float
    recover_s: float
    max_impacts: int
    max_ringing: int
    max_textures: int
    pitch_varies: float
    grain_strength: float
    grains_per_s: float
    grain_back: float
    pad: PadRules
    sound: SoundRules | None


class Feel(msgspec.Struct, frozen=True):
    """A feel file. Grids are [speed][force] at `speeds_mps` and `forces_n`."""

    version: int
    voice: str
    ranges: dict[str, tuple[float, float]]
    words: dict[str, tuple[str, ...]]
    rules: Rules
    speeds_mps: Values
    forces_n: Values
    impacts: dict[str, ImpactTable]
    materials: dict[str, MaterialFeel]
    clips: dict[str, Clip]
    loops: dict[str, LoopClip]


def feel(table: Mapping[str, Material], voice: str) -> Feel:
    """Return the feel of these materials in one of VOICES; some tenths of a second for each new."""
    writer = _Writer(voice, {}, {"slips": _slips(voice)})
    materials = {}
    for name, material in sorted(table.items()):
        materials[name], own = _rendered(voice, name, material.vibration)
        writer.clips.update(own.clips)
        writer.loops.update(own.loops)
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
        materials=materials,
        clips=writer.clips,
        loops=writer.loops,
    )


# A folder of scenes is baked in one go, and most of its scenes have the same materials.
@lru_cache(maxsize=64)
def _rendered(voice: str, name: str, facts: Vibration) -> tuple[MaterialFeel, _Writer]:
    writer = _Writer(voice, {}, {})
    return _material(writer, name, facts), writer


@lru_cache(maxsize=2)
def _slips(voice: str) -> LoopClip:
    writer = _Writer(voice, {}, {})
    writer.loop("slips", loops.stick_slip(), [textures.slips_hz(speed) for speed in SPEEDS_MPS])
    return writer.loops["slips"]


def encode(file: Feel) -> bytes:
    """Return the contents of a feel file."""
    return msgspec.json.encode(file) + b"\n"


def _ranges() -> dict[str, tuple[float, float]]:
    """Return the range of each quantity that a touch or a surface states, as the wire has it."""
    schema = msgspec.json.schema(messages.Touch)["$defs"]["Touch"]["properties"]
    wire = {name: schema[name] for name in ("speed_mps", "force_n")}
    thickness = msgspec.json.schema(messages.SceneObject)["$defs"]["SceneObject"]["properties"]
    wire["thickness_m"] = next(
        part for part in thickness["thickness_m"]["anyOf"] if "maximum" in part
    )
    ranges = {
        name: (float(part.get("minimum", _THINNEST_M)), float(part["maximum"]))
        for name, part in wire.items()
    }
    shares = dict.fromkeys(("gain", "impact_gain", "hum.level"), (0.0, 1.0))
    return ranges | shares | {"hum.frequency_hz": (1.0, 1000.0)}


def _rules(voice: str) -> Rules:
    hertz = tuple(float(hz) for hz in (20, 30, 40, 60, 80, 120, 160, 200, 250, 320, 400))
    edges, weights = sound_voice.EDGES_HZ, sound_voice.WEIGHTS
    sound = SoundRules(
        level=sound_voice.LEVEL,
        exponent=sound_voice.EXPONENT,
        lowest=sound_voice.LOWEST,
        fall_per_s=sound_voice.FALL_PER_S,
        times=sound_voice.TIMES,
        shift_hz=sound_voice.SHIFT_HZ,
        hum_weight=tuple(weights[np.searchsorted(edges, hz, "right") - 1] for hz in hertz),
    )
    pad = PadRules(
        horizon_s=vibration_plan.HORIZON_S,
        period_s={str(form): period for form, period in vibration_plan.PERIOD_S.items()},
        scale={str(form): scale for form, scale in controller_scale.SCALE.items()},
        exponent=controller_scale.EXPONENT,
        min_level=controller_scale.MIN_LEVEL,
        min_impact=controller_scale.MIN_IMPACT,
        min_impact_s=vibration_plan.MIN_IMPACT_S,
        min_amplitude=vibration_plan.MIN_AMPLITUDE,
        hum_hz=hertz,
        hum_felt=_rounded(
            10.0
            ** (
                (
                    drive_threshold_db(np.array([controller_scale.CARRIER_HZ]))
                    - drive_threshold_db(np.array(hertz))
                )
                / 20.0
            )
        ),
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
        pitch_varies=impacts.PITCH_VARIES,
        grain_strength=grains.STRENGTH,
        grains_per_s=grains.MAX_RATE_HZ,
        grain_back=grains.BACK,
        pad=pad,
        sound=sound if voice == "sound" else None,
    )


def _impact_table(kind: str) -> ImpactTable:
    strength = partial(impacts.strength, kind)
    return ImpactTable(
        contact_s=_grid(lambda motion: impacts.contact_s(kind, motion)),
        palm=_grid(lambda motion: strength(motion) ** impacts.COMPRESSION),
        pad=_grid(strength),
    )


def _material(writer: _Writer, name: str, facts: Vibration) -> MaterialFeel:
    writer.shot(
        f"{name} grain",
        textures.grain(facts, NOMINAL),
        textures.grain(facts, vibration_plan.PLAYBACK),
    )
    period_m = facts.swung_m / textures.STROUHAL
    relief = loops.noise(facts.bandwidth, facts.roughness)
    writer.loop(
        f"{name} relief", relief, [textures.centre_hz(v / facts.pitch_m) for v in SPEEDS_MPS]
    )
    air = loops.noise(textures.shed(facts.roughness), 0.0)
    writer.loop(f"{name} air", air, [textures.centre_hz(v / period_m) for v in SPEEDS_MPS])
    blown = _grid(lambda motion: textures.RMS * textures.share("swing", motion))
    yields = math.isfinite(facts.stiffness)
    return MaterialFeel(
        hz=facts.modes[0].frequency_hz,
        **{kind: _impact(writer, name, kind, facts) for kind in IMPACTS},
        slide=Texture(_sliding("slide", name, facts)),
        carve=_carving(name, facts),
        swing=Texture((Layer(f"{name} air", blown),), facts.swung_m),
        grain=f"{name} grain",
        n_per_grain=_number(facts.stiffness * grains.STEP_M) if yields else None,
    )


def _impact(writer: _Writer, material: str, kind: str, facts: Vibration) -> Impact:
    """Render an impact at three lengths of contact, which are spread over those of usual blows."""
    damping = impacts.DAMPING[kind]
    limits = impacts.leaves_band(facts, damping)
    gains = impacts.log_gains(facts, damping)
    usual = np.log([impacts.contact_s(kind, motion) for motion in _USUAL])
    lengths = [float(length) for length in np.exp(np.quantile(usual, _SPREAD))]
    names = []
    for number, contact_s in enumerate(lengths):
        level = math.exp(np.interp(math.log(contact_s), np.log(impacts.LENGTHS_S), gains))
        waves = [
            level * impacts.struck(facts.modes, contact_s, damping, rate_hz, limits=limits)
            for rate_hz in (RATE_HZ, vibration_plan.PLAN_HZ)
        ]
        names.append(f"{material} {kind} {number}")
        writer.shot(names[-1], *waves)
    still = Motion(math.inf, 0.0)  # at full strength
    palm = impacts.level_of(facts, kind, still, NOMINAL.full_scale_db)
    pad = impacts.level_of(facts, kind, still, None)
    return Impact(tuple(names), _rounded(lengths), _number(palm), _number(pad))


def _sliding(kind: str, material: str, facts: Vibration) -> tuple[Layer, ...]:
    stick = textures.sticks(facts, kind)

    def level(part: int) -> Grid:
        return _grid(
            lambda motion: (
                textures.RMS * textures.strengths(kind, facts.roughness, stick, motion)[part]
            )
        )

    rubbing = Layer(f"{material} relief", level(1))
    return (rubbing, Layer("slips", level(2))) if stick else (rubbing,)


def _carving(material: str, facts: Vibration) -> Carving:
    if textures.is_hard(facts):
        return Carving(_sliding("carve", material, facts), 1.0, None, None)
    spacing_m = textures.BREAK_PERIODS * facts.pitch_m
    per_s = _rounded([textures.breaks_hz(spacing_m, speed) for speed in SPEEDS_MPS])
    level = _grid(partial(textures.share, "carve"))
    return Carving(None, textures.CARVE_RUB, level, per_s)


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
    """Collects the clips of one voice."""

    voice: str
    clips: dict[str, Clip]
    loops: dict[str, LoopClip]

    def shot(self, name: str, wave: _Floats, pad: _Floats) -> None:
        """Add a wave (N,) at RATE_HZ that sounds once; `pad` is the same at PLAN_HZ."""
        played, rate_hz = self._at_low_rate(np.concatenate((wave, np.zeros(RATE_HZ // 50))))
        late = round(voices.DELAY_S * vibration_plan.PLAN_HZ)
        drive, felt, hertz = _tracks(np.pad(pad, (late, vibration_plan.PLAN_HZ // 50)))
        body = self._body(np.pad(wave, round(sound_voice.HALF_S * RATE_HZ)))
        most = _number(1.0 / float(np.abs(wave).max()))
        played = played[
            : 1
            + int(np.flatnonzero(np.abs(played) > _SILENT[self.voice] * np.abs(played).max())[-1])
        ]
        self.clips[name] = Clip(
            rate_hz=rate_hz,
            **_packed(played),
            most=most,
            drive=_track(drive),
            felt=_track(felt),
            hz=_bytes(np.round(150.0 * np.log10(hertz / 20.0))),
            body=body,
        )

    def loop(self, name: str, loop: Loop, centres_hz: list[float]) -> None:
        """Add the first periods of a loop, their end joined to their beginning.

        `centres_hz` has, for each of SPEEDS_MPS, the periods a second at which it is read.
        """
        periods = min(PERIODS[self.voice], loop.size // loop.samples - _JOIN)
        wave = _joined(loop, periods)
        relief = _resampled(wave, round(periods / REFERENCE_HZ * RATE_HZ))
        played, rate_hz = self._at_low_rate(relief, is_loop=True)
        step = round(STEP_S * RATE_HZ)
        rows = relief[: relief.size // step * step].reshape(-1, step)
        half = round(sound_voice.HALF_S * RATE_HZ)
        centres = np.array(centres_hz)
        moved = sound_voice.SHIFT_HZ / sound_voice.TIMES  # a voice at 4 f + 300 Hz has this rate
        on_pad = [_on_pad(wave, loop.samples * hz / vibration_plan.PLAN_HZ) for hz in centres_hz]
        self.loops[name] = LoopClip(
            rate_hz=rate_hz,
            **_packed(played),
            drive=_track(np.sqrt(2.0 * np.mean(rows**2, axis=1))),
            body=self._body(np.pad(relief, half, "wrap")),
            gain=_rounded(np.interp(centres, GRID_HZ, loop.drive)),
            rate=_rounded(centres / REFERENCE_HZ),
            wave_rate=_rounded(
                (centres + moved) / (REFERENCE_HZ + moved)
                if self.voice == "sound"
                else centres / REFERENCE_HZ
            ),
            felt=_rounded([felt for felt, _ in on_pad]),
            hz=_rounded([hertz for _, hertz in on_pad]),
        )

    def _at_low_rate(self, wave: _Floats, *, is_loop: bool = False) -> tuple[_Floats, int]:
        """Return a wave (N,) in this voice at the lowest rate that holds it, and that rate."""
        if self.voice == "sound":
            quiet = 0.1 * wave / np.abs(wave).max()  # the voice clips at 1
            line = np.tile(quiet, 3) if is_loop else quiet
            voiced = sound_voice.as_sound(line.astype(np.float32), compresses=False)
            begin = wave.size if is_loop else 0
            voiced = voiced[begin : begin + wave.size] * (10.0 * np.abs(wave).max())
            if not is_loop:
                voiced[: _FADE.size] *= _FADE
            wave = voiced.astype(np.float64)
        power = np.abs(np.fft.rfft(wave)) ** 2
        above = np.cumsum(power[::-1])[::-1] / power.sum()
        highest_hz = (
            float(np.argmax(above < 10.0 ** (_ABOVE_DB[self.voice] / 10.0))) * RATE_HZ / wave.size
        )
        rates = _RATES_HZ[self.voice]
        rate_hz = next((rate for rate in rates if rate >= _ROOM * highest_hz), rates[-1])
        return _resampled(wave, round(wave.size * rate_hz / RATE_HZ)), rate_hz

    def _body(self, padded: _Floats) -> Track | None:
        """Return the rms under the window of the sound voice around each step of a padded wave."""
        if self.voice == "true":
            return None
        window = 2 * round(sound_voice.HALF_S * RATE_HZ)
        sums = np.concatenate(([0.0], np.cumsum(padded**2)))
        means = (sums[window:] - sums[:-window]) / window
        return _track(np.sqrt(means[:: round(STEP_S * RATE_HZ)]))


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


def _resampled(wave: _Floats, count: int) -> _Floats:
    spectrum = np.fft.rfft(wave)
    return np.asarray(np.fft.irfft(spectrum, count) * (count / wave.size))


def _grid(value: Callable[[Motion], float]) -> Grid:
    return tuple(
        tuple(_number(value(Motion(speed, force)), 3) for force in FORCES_N) for speed in SPEEDS_MPS
    )


def _packed(wave: _Floats) -> dict[str, Any]:
    peak = float(np.abs(wave).max())
    samples = np.round(wave * (127.0 / peak)).astype(np.int8)
    return {"peak": _number(peak), "wave": base64.b64encode(samples.tobytes()).decode("ascii")}


def _track(values: _Floats) -> Track:
    peak = float(values.max())
    decibels = -40.0 * np.log10(np.maximum(values / peak, 1e-9))
    return Track(_number(peak), _bytes(np.round(decibels)))


def _bytes(values: _Floats) -> str:
    data = np.clip(values, 0, _FLOOR).astype(np.uint8)
    return base64.b64encode(data.tobytes()).decode("ascii")


def _rounded(values: _Floats | list[float]) -> Values:
    return tuple(_number(float(value)) for value in values)


def _number(value: float, figures: int = FIGURES) -> float:
    return float(f"{value:.{figures}g}")
