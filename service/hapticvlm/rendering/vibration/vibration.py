"""Defines the interactions and motions from which vibration is synthesised: the grammar. Pure.

A material and a motion give a waveform for the palm, 1-1000 Hz at 48 kHz. Every material of the
table can be combined with every interaction:

| interaction | what the palm feels | module |
|---|---|---|
| tap, strike, press | decaying modes of the material, excited by a pulse | impacts |
| slide | the relief of the surface, read at the hand's speed, and stick-slip | textures, loops |
| carve | the same, and a train of fibre breaks | textures |
| swing | noise swept by speed, from the air and not from the material | textures |

The paper's five patterns are points of this grammar, and recordings may replace any (patterns). All
waveforms are levelled by what a palm on a speaker feels (perceived_level), bent into the band of
touch where physics leaves it (textures), and corrected for the speaker in use (equaliser).

This module holds what all of them share. A stroke moves to and fro: it sweeps for SWEEP_S, pauses
for PAUSE_S if the hand has to return first, and then the next sweep begins. The speed follows the
minimum-jerk movement, 16 x^2 (1 - x)^2 of the peak at a share x of a sweep, so it starts and ends
at rest (docs/physics.md 4.3). The speed of an impact is the one at which the hand arrives.
"""

from __future__ import annotations

from dataclasses import dataclass

RATE_HZ = 48_000
IMPACTS = ("tap", "strike", "press")
TEXTURES = ("slide", "carve", "swing")
INTERACTIONS = (*IMPACTS, *TEXTURES)
VOICES = ("true", "sound")  # what the palm speaker gets, and what ears hear (sound_voice)
SWEEP_S = {"slide": 0.6, "carve": 0.6, "swing": 0.4}
PAUSE_S = {"slide": 0.0, "carve": 0.2, "swing": 0.4}  # nothing is felt while a blade returns


@dataclass(frozen=True, slots=True)
class Motion:
    """Speed (m/s) and force (N) of the hand over or onto a surface, both >= 0."""

    speed_mps: float
    force_n: float


def motion_at(interaction: str, peak: Motion, elapsed_s: float) -> Motion:
    """Return the motion `elapsed_s` after the first of several strokes with this peak began."""
    if interaction not in SWEEP_S:
        return peak
    sweep_s = SWEEP_S[interaction]
    place = min((elapsed_s % (sweep_s + PAUSE_S[interaction])) / sweep_s, 1.0)
    return Motion(peak.speed_mps * 16.0 * (place * (1.0 - place)) ** 2, peak.force_n)
