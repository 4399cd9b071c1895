"""Touches of the golden vectors of a player: cases, each a list of events in the order of time.

An event is a touch, a stop, or a plan of one hand.
"""

from __future__ import annotations

from typing import Any

from hapticvlm.rendering.vibration.controller_scale import Form
from hapticvlm.rendering.vibration.vibration import IMPACTS

Json = dict[str, Any]
FORMS: tuple[Form, ...] = ("amplitude", "parametric")
RENEW_S = 0.02  # between two touches of a hand that moves on, as a scene sends them
PLANS_S = (0.0, 0.04, 0.14)  # after the first touch; each covers 0.1 s
SWINGS = 6.0  # times as fast as a hand on a surface
BEGIN_S = 10.0  # of each case, on its clock


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
    """Return a stroke whose hand is not heard of again: its lease ends in silence."""
    events = [_touch(BEGIN_S, phase, "glass", speed_mps=0.8) for phase in ("contact", "slide")]
    events += [_planned(BEGIN_S + after) for after in (0.0, 0.1, 0.2, 0.25, 0.26, 0.4)]
    return {"name": "a stroke that is not renewed", "events": events}


def stopped() -> Json:
    """Return a stop during a slide, touches that it holds off, a release, and the same again."""
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
        {"at_s": at + 0.15, "stop": True},
        _touch(at + 0.15, "contact", "wood"),
        _planned(at + 0.15),
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


def swung_and_struck() -> Json:
    """Return blows between which the hand goes on swinging, so that more ring than may."""
    events = []
    for number in range(16):
        at_s = BEGIN_S + 0.003 * number
        events.append(_touch(at_s, "contact", "glass", speed_mps=0.5 + 0.1 * number))
        events += [_planned(at_s)] if number % 3 == 0 else []
        events.append(_touch(at_s + 0.001, "approach", "glass", interaction="swing"))
    return {"name": "blows of a hand that swings on", "events": events}


def many_textures() -> Json:
    """Return a slide over one material after the other, faster than they fade."""
    events = []
    for after_s, surface in ((0, "wood"), (0.1, "stone"), (0.106, "rubber"), (0.109, "metal")):
        events.append(_touch(BEGIN_S + after_s, "slide", surface, speed_mps=0.6))
    events += [_planned(BEGIN_S + after_s) for after_s in (0.109, 0.114, 0.15)]
    return {"name": "a slide over four materials", "events": events}


def kneaded() -> Json:
    """Return a press on rubber whose force goes and comes."""
    events = []
    for number in range(30):
        at_s = BEGIN_S + RENEW_S * number
        force_n = 1.0 + 0.8 * abs(number % 10 - 5)
        fields: Json = {"speed_mps": 0.0, "force_n": force_n, "interaction": "press"}
        events.append(_touch(at_s, "contact", "rubber", **fields))
        events += [_planned(at_s)] if number % 4 == 0 else []
    return {"name": "a press whose force goes and comes", "events": events}


def _is_planned(at_s: float) -> bool:
    return any(abs(at_s - BEGIN_S - planned_s) < 1e-6 for planned_s in PLANS_S)


def _touch(at_s: float, phase: str, surface: str | None, **fields: Any) -> Json:
    touch = {"type": "touch", "id": 1, "phase": phase, "hand": "right", "object_id": surface}
    defaults = {"speed_mps": 0.3, "force_n": 1.5}
    given = {key: value for key, value in touch.items() if value is not None}
    return {"at_s": round(at_s, 6), "touch": {**given, **defaults, **fields}}


def _planned(at_s: float) -> Json:
    return {"at_s": round(at_s, 6), "plan": "right"}
