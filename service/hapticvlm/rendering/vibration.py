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
physics leaves it (textures), and made for the speaker at hand (playback).
"""

from __future__ import annotations

from hapticvlm.rendering.equaliser import NOMINAL, Correction, Playback
from hapticvlm.rendering.impacts import impact
from hapticvlm.rendering.interactions import IMPACTS, RATE_HZ, TEXTURES, Motion
from hapticvlm.rendering.textures import Texture

__all__ = [
    "IMPACTS",
    "NOMINAL",
    "RATE_HZ",
    "TEXTURES",
    "Correction",
    "Motion",
    "Playback",
    "Texture",
    "impact",
]
