"""Defines the paper's five patterns as points of the grammar, and replaces patterns by recordings.

A recording is converted so that it can stand in for a synthesised pattern: one channel at RATE_HZ,
without the recorder's offset, nothing outside the band of touch, as strong to the palm as the
pattern it replaces. An impact begins at its onset and is faded in and out; a texture is joined into
a loop. Force and speed set the level of a recording as
they set that of the pattern; its pitch does not change with speed. Pure.
"""

from __future__ import annotations

import copy
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from hapticvlm.errors import HapticVLMError
from hapticvlm.materials import MATERIALS, Material, Vibration
from hapticvlm.rendering.vibration import impacts, textures
from hapticvlm.rendering.vibration.equaliser import NOMINAL, Correction, Playback
from hapticvlm.rendering.vibration.filters import resample
from hapticvlm.rendering.vibration.perceived_level import perceived_amplitude
from hapticvlm.rendering.vibration.smoothing import SmoothedValue
from hapticvlm.rendering.vibration.vibration import IMPACTS, INTERACTIONS, RATE_HZ, Motion

_Floats = NDArray[np.float64]

SHORTEST_S = 0.02
LONGEST_S = 10.0
LONGEST_IMPACT_S = 2.0
RATES_HZ = (2_000, 384_000)
# A recording is passed unchanged from LOW_HZ to HIGH_HZ and faded to nothing at 0 and at 1000 Hz.
LOW_HZ = 10.0
HIGH_HZ = 900.0
EDGE_HZ = 100.0
_CANCELLED_SHARE = 0.01  # of the peak of the channels, left in their mean
_SILENT = 1e-4  # of full scale, rms within the band
_MIN_SHARE = 0.03  # of the recording's rms must lie in the band; a cut alone leaves about 0.01
_LEAD_S = 0.001  # of an impact before its onset, and its fade-in
_ONSET_SHARE = 0.2  # of the loudest millisecond: an event begins above it
_QUIET_SHARE = 0.1
_QUIET_S = 0.05  # between two events
_FADE_S = 0.005
_JOIN_S = 0.05
_PEAK = 0.9
_RATE_STEPS = 2_000  # a ratio of rates is approximated by integers up to this


class PatternError(HapticVLMError, ValueError):
    """A recording cannot be used as a pattern; the message says why and what to do."""


@dataclass(frozen=True, slots=True)
class Preset:
    """One of the paper's patterns, with the peak motion that it is shown with."""

    name: str
    material: str
    interaction: str
    motion: Motion


# Names and events are the paper's. Its recordings are not published, so the motions are our choice:
# rubbing gives 100 Hz and the whoosh up to 280 Hz, because the paper's participants confused these
# two.
PRESETS = (
    Preset("wood-carving", "wood", "carve", Motion(0.15, 4.0)),
    Preset("wood-striking", "wood", "strike", Motion(1.0, 3.0)),
    Preset("glass-tapping", "glass", "tap", Motion(0.6, 1.0)),
    Preset("fabric-rubbing", "fabric", "slide", Motion(0.1, 1.5)),
    Preset("metal-whooshing", "metal", "swing", Motion(6.0, 0.0)),
)


@dataclass(frozen=True, slots=True, eq=False)
class Pattern:
    """A recording that replaces (material, interaction); `samples` is (N,) float32 at RATE_HZ.

    `replaced` is the vibration of that material, and `lead_s` the time that was cut before the
    onset of an impact, in s.
    """

    material: str
    interaction: str
    samples: NDArray[np.float32]
    replaced: Vibration
    lead_s: float = 0.0

    @property
    def key(self) -> tuple[str, str]:
        """Material and interaction that it replaces."""
        return self.material, self.interaction

    def impact(self, motion: Motion, playback: Playback = NOMINAL) -> NDArray[np.float32]:
        """Waveform (N,) float32 of one impact with this motion, within [-1, 1]."""
        full = _full_level(self.replaced, self.interaction)
        level = impacts.level_of(self.replaced, self.interaction, motion, playback.full_scale_db)
        wave = self.samples * np.float32(level / full)
        return np.asarray(wave / max(float(np.abs(wave).max()), 1.0))


class PatternTexture:
    """Plays a recorded texture as a loop; its state makes consecutive blocks join."""

    def __init__(self, pattern: Pattern, rate_hz: int = RATE_HZ) -> None:
        self._pattern = pattern
        self._rate_hz = rate_hz
        self._at = 0
        self._level = SmoothedValue()

    def fork(self) -> PatternTexture:
        """Return an independent copy in the same state."""
        forked = copy.copy(self)
        forked._level = self._level.fork()
        return forked

    def render(self, count: int, motion: Motion) -> NDArray[np.float32]:
        """Next `count` samples, (count,) float32, under a motion that holds for all of them."""
        target = textures.share(self._pattern.interaction, motion)
        level = self._level.follow(target, count, self._rate_hz)
        loop = self._pattern.samples
        index = (self._at + np.arange(count)) % loop.size
        self._at = (self._at + count) % loop.size
        return np.asarray(loop[index] * level, dtype=np.float32)


def replaced_key(stem: str, materials: Iterable[str]) -> tuple[str, str]:
    """Return the (material, interaction) that a file with this stem, in any case, replaces.

    Raises PatternError, naming the stems that are possible.
    """
    known = {name.casefold(): name for name in materials}
    for preset in PRESETS:
        if stem.casefold() == preset.name:
            return preset.material, preset.interaction
    material, _, interaction = stem.casefold().rpartition("-")
    if material in known and interaction in INTERACTIONS:
        return known[material], interaction
    presets = ", ".join(preset.name for preset in PRESETS)
    raise PatternError(
        f"`{stem[:60]}` is not the name of a pattern: use MATERIAL-INTERACTION with a material of "
        f"{', '.join(known.values())} and one of {', '.join(INTERACTIONS)}, or one of {presets}"
    )


def pattern(
    key: tuple[str, str],
    samples: _Floats,
    rate_hz: int,
    correction: Correction = Correction(),  # noqa: B008 - frozen
    table: Mapping[str, Material] = MATERIALS,
) -> Pattern:
    """Create a pattern from a recording, (N,) or (N, channels) at `rate_hz`.

    `key` is the (material, interaction) that it replaces, and `table` holds the materials. Raises
    PatternError.
    """
    material, interaction = key
    mono = _checked(samples, rate_hz)
    whole = resampled(_without_offset(mono), rate_hz)
    wave = _within_band(whole, correction)
    within_rms, rms = (float(np.sqrt(np.mean(samples**2))) for samples in (wave, whole))
    if within_rms < max(_SILENT, _MIN_SHARE * rms):
        raise PatternError("nothing can be felt within 10-1000 Hz; choose another recording")
    lead_s = 0.0
    if interaction in IMPACTS:
        wave, lead_s = _from_onset(wave)
        wave = _faded(wave)
    else:
        wave = _joined(wave)
    wave *= _level(wave, interaction, table[material].vibration)
    replaced = table[material].vibration
    return Pattern(material, interaction, np.asarray(wave, dtype=np.float32), replaced, lead_s)


def resampled(wave: _Floats, rate_hz: int) -> _Floats:
    """Resample a wave (N,) from `rate_hz` to RATE_HZ."""
    if rate_hz == RATE_HZ:
        return wave
    ratio = Fraction(RATE_HZ, rate_hz).limit_denominator(_RATE_STEPS)
    return resample(wave, ratio.numerator, ratio.denominator)


def _checked(samples: _Floats, rate_hz: int) -> _Floats:
    if not RATES_HZ[0] <= rate_hz <= RATES_HZ[1]:
        raise PatternError(
            f"its rate of {rate_hz} Hz is not within {RATES_HZ[0]}..{RATES_HZ[1]}; resample it"
        )
    seconds = samples.shape[0] / rate_hz
    if not SHORTEST_S <= seconds <= LONGEST_S:
        remedy = "record longer" if seconds < SHORTEST_S else "cut it"
        raise PatternError(f"lasts {seconds:.3g} s, not {SHORTEST_S:g} to {LONGEST_S:g}; {remedy}")
    mono = samples.mean(axis=1) if samples.ndim == 2 else samples
    if np.abs(mono).max() < _CANCELLED_SHARE * np.abs(samples).max():
        raise PatternError("its channels cancel each other, one is inverted; export one channel")
    if not np.isfinite(mono).all():
        raise PatternError("holds values that are not numbers; export it again")
    if float(np.abs(mono).max()) > 1e3:
        raise PatternError("holds values beyond 1000 times full scale; export it again")
    return np.asarray(mono, dtype=np.float64)


def _without_offset(wave: _Floats) -> _Floats:
    """Remove what the recorder adds to every sample, such as gravity in an accelerometer.

    Its level is the median, because the event is short or symmetric. The edges of the file would
    otherwise be steps of that height, which are felt as thumps and take the level of the event.
    """
    return wave - np.median(wave)


def _from_onset(wave: _Floats) -> tuple[_Floats, float]:
    """Cut an impact to _LEAD_S before its onset, so that it is felt with the touch.

    Returns the wave (N,) and the seconds that were cut. Raises PatternError if it holds several
    events, which would be felt as one touch, or lasts too long from its onset.
    """
    step = round(_LEAD_S * RATE_HZ)
    level = np.abs(wave[: wave.size // step * step]).reshape(-1, step).max(axis=1)
    loud = np.flatnonzero(level > _ONSET_SHARE * level.max())
    # An event ends where the level stays below _QUIET_SHARE for _QUIET_S. A wave that decays and
    # beats crosses the higher share several times, and the lower one for no longer than a beat.
    heard = np.flatnonzero(level > _QUIET_SHARE * level.max())
    ends = heard[:-1][np.diff(heard) * _LEAD_S > _QUIET_S]
    later = [loud[loud > end] for end in ends if end > loud[0]]
    onsets = sorted({int(loud[0]), *(int(each[0]) for each in later if each.size)})
    if len(onsets) > 1:
        times = ", ".join(f"{onset * _LEAD_S:.2f}" for onset in onsets[:6])
        raise PatternError(
            f"holds {len(onsets)} events (at {times} s), and a touch plays one; cut it to one"
        )
    start = max(onsets[0] - 1, 0) * step
    seconds = (wave.size - start) / RATE_HZ
    if seconds > LONGEST_IMPACT_S:
        raise PatternError(
            f"lasts {seconds:.3g} s from its onset, at most {LONGEST_IMPACT_S:g}; cut its end"
        )
    if onsets[0] == 0:  # nothing before the event, and the fade needs _LEAD_S
        wave = np.concatenate((np.zeros(step), wave))
    return wave[start:], start / RATE_HZ


def _within_band(wave: _Floats, correction: Correction) -> _Floats:
    """Filter to the band of touch, with smooth edges that ring little, and correct the speaker."""
    padded = np.concatenate((wave, np.zeros(RATE_HZ // 10)))
    hertz = np.arange(padded.size // 2 + 1.0) * (RATE_HZ / padded.size)
    rise = np.clip(hertz / LOW_HZ, 0.0, 1.0)
    fall = np.clip((hertz - HIGH_HZ) / EDGE_HZ, 0.0, 1.0)
    gains = np.sin(0.5 * np.pi * rise) ** 2 * np.cos(0.5 * np.pi * fall) ** 2
    spectrum = np.fft.rfft(padded) * gains * correction.gains(hertz)
    return np.asarray(np.fft.irfft(spectrum, padded.size)[: wave.size])


def _faded(wave: _Floats) -> _Floats:
    """Fade an impact in over the time before its onset, and out over _FADE_S."""
    wave = wave.copy()
    for part, seconds in ((wave, _LEAD_S), (wave[::-1], _FADE_S)):
        count = min(round(seconds * RATE_HZ), wave.size // 2)
        part[:count] *= 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, count))
    return wave


def _joined(wave: _Floats) -> _Floats:
    """Cross-fade the end into the beginning at constant power, so that the loop has no seam."""
    count = min(int(_JOIN_S * RATE_HZ), wave.size // 3)
    turn = np.linspace(0.0, 0.5 * np.pi, count)
    joined = wave[:-count].copy()
    joined[:count] = np.sin(turn) * wave[:count] + np.cos(turn) * wave[-count:]
    return joined


def _level(wave: _Floats, interaction: str, replaced: Vibration) -> float:
    """Return the gain that makes it as strong as the replaced pattern, if its peaks allow."""
    if interaction in IMPACTS:
        gain = _full_level(replaced, interaction) / perceived_amplitude(wave)
    else:
        full = textures.RMS * (1.0 if interaction == "swing" else replaced.roughness)
        gain = full * float(np.sqrt(wave.size)) / perceived_amplitude(wave)
    return float(min(gain, _PEAK / np.abs(wave).max()))


def _full_level(replaced: Vibration, interaction: str) -> float:
    return impacts.full_strength(interaction) * impacts.hardness(replaced)
