"""Which channels of an audio output move which hand. Pure.

Without them an output is one speaker under one palm, and both hands are mixed into it. With them
each hand is rendered by itself, for two exciters, a pair of gloves, or a controller whose grips are
voice coils; whatever else the output's channels drive stays silent.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

MAX_CHANNEL = 8
# Where each channel of an output stands, by how many it has, as audio systems count them (and a
# WAVE file does): without it they take the third of four for the centre, and mix it into the front.
# 2, 3 front left and right, 4 centre, 5 low frequencies, 6, 7 rear, 11, 12 side (miniaudio's
# numbers).
POSITIONS = {
    2: (2, 3),
    4: (2, 3, 6, 7),
    6: (2, 3, 4, 5, 6, 7),
    8: (2, 3, 4, 5, 6, 7, 11, 12),
}
_SYNTAX = re.compile(r"left=(\d{1,2}),right=(\d{1,2})")
_DUALSENSE_NAMES = (
    "wireless controller",
    "dualsense",
)  # what systems call a PS5 controller's sound

DUALSENSE = "dualsense"


@dataclass(frozen=True, slots=True)
class Channels:
    """The output's channels of the left and the right hand, counted from 1."""

    left: int
    right: int

    @property
    def min_count(self) -> int:
        """How many channels an output must have; the others are opened, too, and stay silent."""
        return max(self.left, self.right)

    def spread(self, hands: NDArray[np.float32], count: int) -> NDArray[np.float32]:
        """Put the hands, (N, 2), onto `count` channels, (N, count), the others silent."""
        spread = np.zeros((len(hands), count), np.float32)
        spread[:, self.left - 1] = hands[:, 0]
        spread[:, self.right - 1] = hands[:, 1]
        return spread


# A DualSense on USB is a sound card of four channels at 48 kHz. The first two are its headset's,
# the others move the voice coils of the left and the right grip.
DUALSENSE_CHANNELS = Channels(3, 4)


def read_channels(text: str) -> Channels:
    """Read left=N,right=M. Raises ValueError."""
    found = _SYNTAX.fullmatch(text.replace(" ", ""))
    left, right = (int(number) for number in found.groups()) if found else (0, 0)
    if not (1 <= left <= MAX_CHANNEL and 1 <= right <= MAX_CHANNEL and left != right):
        raise ValueError(
            f"--channels {text}: give two different channels of the output, 1 to {MAX_CHANNEL}, for "
            "example left=1,right=2"
        )
    return Channels(left, right)


def is_dualsense(name: str) -> bool:
    """Return whether an output of this name is a PS5 controller."""
    return any(part in name.lower() for part in _DUALSENSE_NAMES)
