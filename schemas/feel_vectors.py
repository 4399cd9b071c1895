"""Golden vectors of the players of `feel.json`: touches, and the vibration that the service plans.

Each case is a list of events in the order of time: a touch, a stop, or a plan of one hand. Touches
go through the session and its planners, as in the service, but on the clock of the events. A
player that receives the same touches has to plan the same amplitudes and frequencies.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from typing import Any

import msgspec

from hapticvlm.materials import MATERIALS
from hapticvlm.messages import MessageError, Scene, SceneObject, Touch
from hapticvlm.rendering.heat.limits import AT_REST
from hapticvlm.rendering.vibration.controller_scale import Form
from hapticvlm.rendering.vibration.vibration import IMPACTS, INTERACTIONS
from hapticvlm.rendering.vibration.vibration_plan import VibrationPlan, VibrationPlanner
from hapticvlm.session.actions import PlayVibration, ReleaseHand
from hapticvlm.session.hands import NAMES, Hold
from hapticvlm.session.session import SceneSession
from hapticvlm.session.settings import SessionSettings

Json = dict[str, Any]
FORMS: tuple[Form, ...] = ("amplitude", "parametric")
RENEW_S = 0.02  # between two touches of a hand that moves on, as a scene sends them
PLANS_S = (0.0, 0.04, 0.14)  # after the first touch; each covers 0.1 s
SPEEDS_MPS = (0.1, 0.4, 1.2)
SWINGS = 6.0  # times as fast as a hand on a surface
BEGIN_S = 10.0  # of each case, on its clock


def cases() -> Iterator[Json]:
    """Yield every golden case with the service's plans."""
    for material in MATERIALS:
        for interaction in INTERACTIONS:
            yield played(touched(material, interaction, 0.4))
    yield played(changing_speed())
    yield played(lapsing())
    yield played(stopped())
    yield played(both_hands())
    yield played(crowded())


def played(case: Json) -> Json:
    """Return the case with the service's plan in each of its `plan` events."""
    hold = Hold()
    session = SceneSession(SessionSettings(owner=True), hold)
    objects = [SceneObject(object_id=name, material=name) for name in MATERIALS]
    session.receive(Scene(id=1, objects=objects, replace=True), BEGIN_S)
    planners = _planners()
    events = []
    for event in case["events"]:
        now = event["at_s"]
        _carry_out(session.tick(now, AT_REST), planners, now)
        if "touch" in event:
            touch = msgspec.convert({"captured_at": now, **event["touch"]}, Touch)
            try:
                _carry_out(session.receive(touch, now), planners, now)
            except MessageError:  # while a stop holds the outputs
                assert hold.holds_all(touch.hand)
        elif "stop" in event:
            hold.stop("all")
            for planner in planners:
                planner.rest()
        elif "plan" in event:
            planner = planners[NAMES.index(event["plan"])]
            plans = {form: _plan(planner.plan(form, now)) for form in FORMS}
            event = {**event, **plans}
        events.append(event)
    return {**case, "events": events}


def touched(material: str, interaction: str, speed_mps: float, force_n: float = 1.5) -> Json:
    """Return one touch: a blow, a press that deepens, or a hand that goes on."""
    events = []
    count = round(PLANS_S[-1] / RENEW_S) + 1
    for number in range(count):
        at_s = BEGIN_S + RENEW_S * number
        deepens = interaction == "press"
        fields: Json = {
            "speed_mps": 0.0 if deepens and number else speed_mps,
            "force_n": force_n * (1 + number / 2) if deepens else force_n,
            "interaction": interaction,
        }
        phase = "contact" if not number or interaction in IMPACTS else "slide"
        if interaction == "swing":
            phase = "approach"
            fields |= {"speed_mps": SWINGS * speed_mps, "force_n": 0.0}
        events.append(_touch(at_s, phase, material, **fields))
        events += [_planned(at_s)] if _is_planned(at_s) else []
    return {"name": f"{material} {interaction} {speed_mps:g}", "events": events}


def changing_speed() -> Json:
    """Return a slide on rubber that speeds up, slows down, and goes over to stone."""
    events = []
    for number in range(30):
        at_s = BEGIN_S + RENEW_S * number
        speed_mps = 0.05 + 0.05 * min(number, 29 - number)
        surface = "rubber" if number < 20 else "stone"
        phase = "contact" if not number else "slide"
        events.append(_touch(at_s, phase, surface, speed_mps=speed_mps, force_n=2.0))
        events += [_planned(at_s)] if number % 4 == 0 else []
    return {"name": "a slide of changing speed over two materials", "events": events}


def lapsing() -> Json:
    """Return a strike whose hand is not heard of again: its lease ends in silence."""
    events = [_touch(BEGIN_S, "contact", "glass", speed_mps=0.8)]
    events += [_planned(BEGIN_S + after) for after in (0.0, 0.1, 0.2, 0.26, 0.4)]
    return {"name": "a strike that is not renewed", "events": events}


def stopped() -> Json:
    """Return a stop during a slide, touches that it holds off, a release, and a new contact."""
    at = BEGIN_S
    events = [
        _touch(at, "contact", "wood"),
        _touch(at + 0.05, "slide", "wood"),
        _planned(at + 0.06),
        {"at_s": at + 0.07, "stop": True},
        _touch(at + 0.08, "slide", "wood"),
        _planned(at + 0.09),
        _touch(at + 0.10, "contact", "wood"),
        _planned(at + 0.11),
        _touch(at + 0.12, "release", None),
        _touch(at + 0.13, "slide", "wood"),
        _planned(at + 0.14),
        _touch(at + 0.15, "release", None),
        _touch(at + 0.16, "contact", "wood"),
        _planned(at + 0.16),
    ]
    return {"name": "a stop, its hold, and a touch after it", "events": events}


def both_hands() -> Json:
    """Return a strike of each hand, of which one is released."""
    at = BEGIN_S
    events = [
        _touch(at, "contact", "metal", hand="left", speed_mps=0.6),
        _touch(at + 0.01, "contact", "fabric", speed_mps=0.6),
        {"at_s": at + 0.01, "plan": "left"},
        _planned(at + 0.01),
        _touch(at + 0.03, "release", None, hand="left"),
        {"at_s": at + 0.05, "plan": "left"},
        _planned(at + 0.05),
    ]
    return {"name": "a strike of each hand", "events": events}


def crowded() -> Json:
    """Return a hand that drums so fast that the limiter and the bound of impacts act."""
    events = []
    for number in range(12):
        at_s = BEGIN_S + 0.03 * number
        events.append(_touch(at_s, "contact", "glass", speed_mps=3.0, force_n=20.0))
        events += [_planned(at_s)] if number % 3 == 0 else []
        events.append(_touch(at_s + 0.01, "approach", "glass"))
    return {"name": "drumming on glass", "events": events}


@lru_cache(maxsize=1)
def _idle_planners() -> tuple[VibrationPlanner, ...]:
    return tuple(VibrationPlanner(MATERIALS) for _ in NAMES)


def _planners() -> tuple[VibrationPlanner, ...]:
    """Return the planners of both hands, at rest; to make them takes a part of a second."""
    for planner in _idle_planners():
        planner.rest()
    return _idle_planners()


def _is_planned(at_s: float) -> bool:
    return any(abs(at_s - BEGIN_S - planned_s) < 1e-6 for planned_s in PLANS_S)


def _touch(at_s: float, phase: str, surface: str | None, **fields: Any) -> Json:
    touch = {"type": "touch", "id": 1, "phase": phase, "hand": "right", "object_id": surface}
    defaults = {"speed_mps": 0.3, "force_n": 1.5}
    given = {key: value for key, value in touch.items() if value is not None}
    return {"at_s": round(at_s, 6), "touch": {**given, **defaults, **fields}}


def _planned(at_s: float) -> Json:
    return {"at_s": round(at_s, 6), "plan": "right"}


def _carry_out(actions: Any, planners: tuple[VibrationPlanner, ...], now: float) -> None:
    for action in actions:
        match action:
            case PlayVibration(command):
                planners[command.hand].apply(command, now)
            case ReleaseHand():
                planners[action.hand].rest()


def _plan(plan: VibrationPlan) -> Json:
    return {
        "amplitude": plan.amplitude,
        "frequency_hz": plan.frequency_hz,
        "transients": [[pulse.amplitude, pulse.frequency_hz] for pulse in plan.pulses],
    }
