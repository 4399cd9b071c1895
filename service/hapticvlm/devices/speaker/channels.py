"""Maps each hand to a channel of an audio output. Pure.

Without such a map an output is one speaker under one palm, and both hands are mixed into it. With a
map each hand is rendered by itself, for two exciters, a pair of gloves, or a controller whose grips
are voice coils. All other channels of the output stay silent.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

MAX_CHANNEL = 8
DUALSENSE = "dualsense"
JACK = "jack"

# Positions of the channels of an output, by the number of its channels, in the order of WAVE files.
# Without them audio systems take the third of four channels for the centre and mix it into the
# front. The numbers are miniaudio's: 2 and 3 are front left and right, 4 centre, 5 low frequencies,
# 6 and 7 rear, 11 and 12 side.
POSITIONS = {
    2: (2, 3),
    4: (2, 3, 6, 7),
    6: (2, 3, 4, 5, 6, 7),
    8: (2, 3, 4, 5, 6, 7, 11, 12),
}
# The profile `Pro Audio` of PipeWire gives channels no position, but numbers: AUX 0 is 20.
_AUX_0 = 20
_SYNTAX = re.compile(r"left=(\d{1,2}),right=(\d{1,2})")
_DUALSENSE_NAMES = ("wireless controller", "dualsense")  # of a PS5 controller's sound output
_OTHER_PADS = ("xbox",)  # whose headset output is called a wireless controller, too


@dataclass(frozen=True, slots=True)
class Channels:
    """The output's channels of the left and the right hand, counted from 1."""

    left: int
    right: int

    @property
    def min_count(self) -> int:
        """Number of channels that an output must have at least."""
        return max(self.left, self.right)

    def spread(self, hands: NDArray[np.float32], count: int) -> NDArray[np.float32]:
        """Copy both hands, (N, 2) float32, into `count` channels, (N, count); others are 0."""
        spread = np.zeros((len(hands), count), np.float32)
        spread[:, self.left - 1] = hands[:, 0]
        spread[:, self.right - 1] = hands[:, 1]
        return spread


# A DualSense on USB is a sound card with four channels at 48 kHz. The first two belong to its
# headset; the third and fourth move the voice coils of the left and the right grip.
DUALSENSE_CHANNELS = Channels(3, 4)


def positions(count: int, *, is_aux: bool = False) -> tuple[int, ...] | None:
    """Return the positions of `count` channels as miniaudio has them; None for its own order."""
    if is_aux and count > 2:  # miniaudio takes two of any kind for left and right
        return tuple(range(_AUX_0, _AUX_0 + count))
    return POSITIONS.get(count)


def read_channels(value: str) -> Channels:
    """Parse the value of --channels, left=N,right=M. Raises ValueError."""
    match = _SYNTAX.fullmatch(value.replace(" ", ""))
    left, right = (int(number) for number in match.groups()) if match else (0, 0)
    if not (1 <= left <= MAX_CHANNEL and 1 <= right <= MAX_CHANNEL and left != right):
        raise ValueError(
            f"--channels {value}: give two different channels of the output, 1 to {MAX_CHANNEL}, "
            "for example left=1,right=2"
        )
    return Channels(left, right)


def channels_of_hands(speaker: str, channels: str | None) -> Channels | None:
    """Return the hands' channels by these options; None: all get the mix. Raises ValueError."""
    if channels is not None:
        return read_channels(channels)
    return DUALSENSE_CHANNELS if speaker.lower() == DUALSENSE else None


def is_dualsense(name: str) -> bool:
    """Return whether the output with this name is a PS5 controller."""
    lower = name.lower()
    is_other = any(part in lower for part in _OTHER_PADS)
    return not is_other and any(part in lower for part in _DUALSENSE_NAMES)
