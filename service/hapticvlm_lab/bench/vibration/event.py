"""What the `vibration` event keeps of the speaker: materials told apart by the machine observer.

Every material is struck and slid with one equal stroke, so only the material differs. The event is
planned as the service plans it, 30 plans a second, and a controller of one frequency plays it: each
display frame takes the amplitude for now. Fixed pulses, the same for all, stand beside it as floor.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import cache

import numpy as np
from numpy.typing import NDArray

from hapticvlm.materials import MATERIALS
from hapticvlm.rendering.vibration.vibration import RATE_HZ, Motion
from hapticvlm.rendering.vibration.vibration_plan import VibrationPlan, VibrationPlanner
from hapticvlm.rendering.vibration.voices import Command, Voices
from hapticvlm_studio.observer.answers import confusion, recognised
from hapticvlm_studio.observer.channels import vibration_steps
from hapticvlm_studio.observer.percepts import Percepts
from hapticvlm_studio.observer.predict import paper_noise

EIGHT = ("wood", "glass", "fabric", "metal", "plastic", "stone", "ceramic", "rubber")
FRAME_HZ = 72.0
PLANS_HZ = 30.0
ACTUATOR_HZ = 170.0
SECONDS = 0.8
RENEWAL_S = 1.0 / 90.0
MOTIONS = {"strike": Motion(1.0, 3.0), "slide": Motion(0.2, 2.0)}
# of the answers, of the strokes
SEED = 5
SEEDS = tuple(range(1, 7))

Wave = NDArray[np.float64]
Matrix = NDArray[np.int64]
Path = Callable[[str, str, int], Wave]


def commands(material: str, interaction: str, seed: int) -> list[tuple[float, Command]]:
    """Return what the session would ask for, with its times, s."""
    motion = MOTIONS[interaction]
    count = round(SECONDS / RENEWAL_S)
    is_strike = interaction == "strike"
    return [
        (at, Command(1, material, interaction, is_strike and at == 0.0, motion, seed, at + 0.25))
        for at in (number * RENEWAL_S for number in range(count))
    ]


def by_speaker(material: str, interaction: str, seed: int) -> Wave:
    """Render what the palm speaker plays, (N,)."""
    voices = Voices(table={material: MATERIALS[material]}, is_warm=False)
    waiting = commands(material, interaction, seed)
    blocks = []
    count = 128
    for start in range(0, round(SECONDS * RATE_HZ), count):
        now = start / RATE_HZ
        while waiting and waiting[0][0] <= now:
            voices.apply(waiting.pop(0)[1])
        blocks.append(voices.render(count, now))
    return np.concatenate(blocks).astype(np.float64)


def by_event(material: str, interaction: str, seed: int) -> Wave:
    """Render what a controller plays of the events' amplitude, once a display frame, (N,)."""
    planner = _planner(material)
    planner.rest()
    waiting = commands(material, interaction, seed)
    plan = VibrationPlan(0.0125)
    planned_at = 0.0
    level = []
    for frame in range(round(SECONDS * FRAME_HZ)):
        now = frame / FRAME_HZ
        begins = bool(waiting) and waiting[0][1].onset
        while waiting and waiting[0][0] <= now:
            planner.apply(waiting[0][1], waiting.pop(0)[0])
        if begins or frame == 0 or now - planned_at >= 1.0 / PLANS_HZ:
            plan = planner.plan("amplitude", now)
            planned_at = now
        place = int((now + 0.5 / FRAME_HZ - planned_at) / plan.period_s)
        level.append(plan.amplitude[place] if place < len(plan.amplitude) else 0.0)
    return _actuator(np.array(level))


def by_pulses(_: str, interaction: str, seed: int) -> Wave:
    """Render fixed pulses, the same for every material, (N,)."""
    jitter = np.random.default_rng(seed).uniform(0.98, 1.02)
    frames = round(SECONDS * FRAME_HZ)
    level = np.zeros(frames) if interaction == "strike" else np.full(frames, 0.2)
    level[:3] = 0.5
    return _actuator(level * jitter)


def taken_for(path: Path, interaction: str, noise: float) -> Matrix:
    """Count how often each of EIGHT (rows) is taken for each (columns), (8, 8)."""
    rows = [
        [vibration_steps(path(material, interaction, s).astype(np.float32), RATE_HZ) for s in SEEDS]
        for material in EIGHT
    ]
    return confusion(Percepts(EIGHT, np.array(rows) / noise), 1.0, SEED)


def main() -> None:
    """Print the table, and as the last line JSON."""
    noise = paper_noise().touch
    paths: dict[str, Path] = {"speaker": by_speaker, "event": by_event, "pulses": by_pulses}
    shares = {
        name: {kind: recognised(taken_for(path, kind, noise)) for kind in MOTIONS}
        for name, path in paths.items()
    }
    for name, share in shares.items():
        print(f"{name:10s} " + "  ".join(f"{kind} {value:.3f}" for kind, value in share.items()))
    print(json.dumps({"noise": noise, "shares": shares, "chance": 1.0 / len(EIGHT)}))


@cache
def _planner(material: str) -> VibrationPlanner:
    return VibrationPlanner({material: MATERIALS[material]})


def _actuator(level: Wave) -> Wave:
    """Play one amplitude a display frame at the actuator's frequency, (N,)."""
    samples = np.arange(round(level.size * RATE_HZ / FRAME_HZ))
    held = level[np.minimum((samples * FRAME_HZ / RATE_HZ).astype(int), level.size - 1)]
    return np.asarray(held * np.sin(2.0 * np.pi * ACTUATOR_HZ * samples / RATE_HZ))


if __name__ == "__main__":
    main()
