"""Tests that a moving hand always feels the surface, and that too hard materials chatter."""

import numpy as np
from each_case import each

from hapticvlm.materials import MATERIALS
from hapticvlm.rendering.vibration.textures import Texture
from hapticvlm.rendering.vibration.vibration import RATE_HZ, Motion, motion_at

WINDOW = RATE_HZ // 200  # 5 ms


@each(
    material=["stone", "fabric", "wood", "rubber"],
    speed_mps=[0.1, 0.3],
    interaction=["slide", "swing"],
)
def test_nothing_is_silent_for_long_while_the_hand_moves(
    material: str, speed_mps: float, interaction: str
) -> None:
    silences = [longest_silence(material, speed_mps, interaction, seed) for seed in range(6)]
    assert max(silences) < 0.04 * RATE_HZ


def longest_silence(material: str, speed_mps: float, interaction: str, seed: int) -> int:
    """Longest run of samples 20 dB below the usual level, while the hand is fast."""
    peak = Motion(speed_mps if interaction == "slide" else 20.0 * speed_mps, 2.0)
    texture = Texture(MATERIALS[material].vibration, interaction, seed)
    moments = [motion_at(interaction, peak, n * WINDOW / RATE_HZ) for n in range(400)]
    levels = np.array([np.sqrt(np.mean(texture.render(WINDOW, it) ** 2)) for it in moments])
    is_fast = np.array([it.speed_mps > peak.speed_mps / 2.0 for it in moments])
    is_silent = (levels < 0.1 * np.median(levels[is_fast])) & is_fast

    longest = max(map(len, "".join(" x"[int(it)] for it in is_silent).split()), default=0)
    return longest * WINDOW


def bursts(material: str) -> float:
    """Relative rms change of a carved texture's level from each 5 ms to the next."""
    texture = Texture(MATERIALS[material].vibration, "carve", seed=4)
    blocks = [texture.render(WINDOW, Motion(0.1, 4.0)) for _ in range(400)]
    levels = np.array([np.sqrt(np.mean(block**2)) for block in blocks[40:]])
    return float(np.std(np.diff(levels)) / levels.mean())


def test_what_is_too_hard_to_be_carved_breaks_no_fibres() -> None:
    assert min(bursts(it) for it in ("wood", "leather")) > 1.3 * max(
        bursts(it) for it in ("glass", "metal")
    )
