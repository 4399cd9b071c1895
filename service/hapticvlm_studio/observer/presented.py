"""Renders a pattern by the service's own session, voices and simulated plate. Pure.

A hand moves as `design/stimuli` states, in virtual time, and releases. Whatever the session asks
for is rendered, so limits, leads, levels and the slowness of the plate are those of the service,
and the observer sees what a device would do rather than what the pattern asks for.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from hapticvlm.devices.simulated.simulated import SimulatedPlate
from hapticvlm.materials import MATERIALS
from hapticvlm.messages import Interaction, Scene, SceneObject, Touch
from hapticvlm.perception import NEUTRAL_C
from hapticvlm.rendering.heat.limits import AT_REST
from hapticvlm.rendering.vibration.vibration import IMPACTS, RATE_HZ, Motion
from hapticvlm.rendering.vibration.voices import Voices
from hapticvlm.session.actions import Action, DrivePlate, PlayVibration, ReleaseHand
from hapticvlm.session.session import SceneSession
from hapticvlm.session.settings import SessionSettings
from hapticvlm_studio.design import stimuli
from hapticvlm_studio.design.stimuli import Part, Stimulus, parts

STEP_S = 0.02  # of the session's tick and of the hand's messages
_FADE_STEPS = 2  # a release is silent within 20 ms
_AMBIENT_C = 22.0


def wave(stimulus: Stimulus, seed: int) -> NDArray[np.float32]:
    """Return the vibration of one presentation from contact on, (N,) at RATE_HZ, full scale 1."""
    voices = Voices(table={stimulus.material: MATERIALS[stimulus.material]})
    session = _session(stimulus)
    count = round(STEP_S * RATE_HZ)
    blocks = []
    for step, part, motion in _hand(stimulus):
        now = step * STEP_S
        for action in session.receive(_touch(stimulus, part, motion, now), now):
            _sound(voices, action, seed)
        blocks.append(voices.render(count, now))
    return np.concatenate(blocks[lead_steps(stimulus) :])


def skin_c(stimulus: Stimulus) -> NDArray[np.float64]:
    """Return the skin on the simulated plate in degC, (steps + 1,), from approach to release.

    Sampled every STEP_S.
    """
    plate = SimulatedPlate(_AMBIENT_C)
    plate.command(NEUTRAL_C, STEP_S, 0.0)
    session = _session(stimulus)
    samples = [plate.skin_c]
    for step, part, motion in _hand(stimulus):
        if part is None:
            break
        now = step * STEP_S
        session.receive(_touch(stimulus, part, motion, now), now)
        for action in session.tick(now, plate.advance(now)):
            if isinstance(action, DrivePlate):
                plate.command(action.setpoint_c, action.ttl_s, now)
        plate.advance(now + STEP_S)
        samples.append(plate.skin_c)
    return np.array(samples)


def lead_steps(stimulus: Stimulus) -> int:
    """Return the number of steps from the approach to the first contact."""
    return round(stimulus.lead_s / STEP_S)


def _hand(stimulus: Stimulus) -> Iterator[tuple[int, Part | None, Motion]]:
    """Yield (step, part, motion) of the hand; the part is None once it has released."""
    step = 0
    ends_s = 0.0
    for part in parts(stimulus):
        begins = step
        ends_s = ends_s + part.seconds
        while step < round(ends_s / STEP_S):
            yield step, part, stimuli.motion(stimulus, part, (step - begins) * STEP_S)
            step += 1
    for _ in range(_FADE_STEPS):
        yield step, None, Motion(0.0, 0.0)
        step += 1


def _session(stimulus: Stimulus) -> SceneSession:
    session = SceneSession(SessionSettings(owner=True, reading=AT_REST))
    scene_object = SceneObject(
        object_id=stimulus.name, material=stimulus.material, temperature_c=stimulus.object_c
    )
    session.receive(Scene(id=1, objects=[scene_object], replace=True, ambient_c=_AMBIENT_C), 0.0)
    return session


def _touch(stimulus: Stimulus, part: Part | None, motion: Motion, now: float) -> Touch:
    interaction: Interaction = stimulus.interaction  # type: ignore[assignment]  # checked by Stimulus
    return Touch(
        id=1,
        phase="release" if part is None else part.phase,
        captured_at=now,
        hand="right",
        speed_mps=motion.speed_mps,
        force_n=motion.force_n,
        object_id=stimulus.name,
        interaction="slide" if part is not None and part.phase == "slide" else interaction,
    )


def _sound(voices: Voices, action: Action, seed: int) -> None:
    """Apply an action of the session to the speaker's voices."""
    if isinstance(action, ReleaseHand):
        voices.release(action.hand)
    elif isinstance(action, PlayVibration):
        command = action.command
        # Renewals of a touch repeat its command. A tap or a strike sounds once, at its onset; only
        # textures go on sounding while the touch lasts.
        if command.onset or command.interaction not in IMPACTS:
            seeded = replace(command, seed=1000 * seed + command.seed)
            voices.apply(seeded)
