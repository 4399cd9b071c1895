"""Material and movement become a waveform for the palm, 1-1000 Hz at 48 kHz: the grammar. Pure.

Any material of the table takes any interaction:

| interaction | what the palm perceives | read more in |
|---|---|---|
| tap, strike, press | decaying modes of the material under a pulse by speed and force | impacts |
| slide | the surface in space, read at the hand's speed, and stick-slip | textures, loops |
| carve | the same, and a train of fibre breaks | textures |
| swing | noise swept by speed, of the air and not of the material | textures |

The paper's five patterns are points of it, and recordings may replace any (patterns). All of
it is levelled as a palm on a speaker feels it (perceived_level), bent into the band of touch where
physics leaves it (textures), and made for the speaker at hand (equaliser).

Here stands what all of it shares: what a hand can do, how hard, and how fast in a stroke. A stroke
goes to and fro, faster and slower like a bell. It sweeps for SWEEP_S and, where the hand must come
back first, pauses; then the next begins. Speed follows the minimum-jerk movement, peak
16 x^2 (1 - x)^2 at a share x of a sweep, so it starts and ends at rest (docs/physics.md 4.3). Blows
have the speed they arrive with.
"""

from __future__ import annotations

from dataclasses import dataclass

RATE_HZ = 48_000
IMPACTS = ("tap", "strike", "press")
TEXTURES = ("slide", "carve", "swing")
INTERACTIONS = (*IMPACTS, *TEXTURES)
SWEEP_S = {"slide": 0.6, "carve": 0.6, "swing": 0.4}
PAUSE_S = {"slide": 0.0, "carve": 0.2, "swing": 0.4}  # a blade and an arm come back unfelt


@dataclass(frozen=True, slots=True)
class Motion:
    """How the hand moves over or onto a surface: m/s and N, both >= 0."""

    speed_mps: float
    force_n: float


def motion_at(interaction: str, peak: Motion, elapsed_s: float) -> Motion:
    """Return the motion so long after the first stroke began, of strokes that peak like this."""
    if interaction not in SWEEP_S:
        return peak
    sweep_s = SWEEP_S[interaction]
    place = min((elapsed_s % (sweep_s + PAUSE_S[interaction])) / sweep_s, 1.0)
    return Motion(peak.speed_mps * 16.0 * (place * (1.0 - place)) ** 2, peak.force_n)
