"""Scripts of a hand that touches while the service behind it dies, freezes and comes back.

Every client's switch between the service and the bake has to pass them, each in a harness of its
own language, on a clock of its own. A step is a line of words:

    begin MODE [alone | beside]      a new scene: with a service, without, or with one that another
                                     scene owns
    pass MS [PHASE ID]               time passes, while the hand touches again and again
    touch PHASE ID
    service alive | frozen | dead
    stop [another | left]            by this scene; by another client; told of the left hand alone
    mode MODE
    own                              the other scene has gone
    mark                             what is said from here on counts from now
    say NAME felt | heard | gap | soon | by | silence | because

`felt` is the strongest vibration, `heard` the loudest sound, `gap` the longest time without
vibration and `soon` the time until a strike is felt, both in ms.
"""

from __future__ import annotations

from typing import Any

CHANGES = 20
STRIKE = 0.2  # the vibration of a struck glass is above it
HELD = "stopped: release and touch again"
NOTHING, SOMETHING = (0, 0), (1e-9, 9)
CASES: dict[str, list[str]] = {}
SAID: dict[str, dict[str, Any]] = {}  # of each case what is to be said: a text, or least and most


def problems(told: dict[str, dict[str, Any]], *unknown: str) -> list[tuple[str, str, Any]]:
    """Return what a harness said otherwise: the case, the name and what it said.

    unknown: names that it cannot say.
    """
    return [
        (case, name, told[case].get(name))
        for case, said in SAID.items()
        for name, wanted in said.items()
        if name not in unknown and not _is(told[case].get(name), wanted)
    ]


def lines() -> str:
    """Return all scripts for a harness that reads lines: each begins with its name."""
    return "\n".join("\n".join([f"case {name}", *steps]) for name, steps in CASES.items())


def _is(said: Any, wanted: Any) -> bool:
    if isinstance(wanted, str):
        return str(said).endswith(wanted) if wanted else str(said) == wanted
    return said is not None and bool(wanted[0] <= float(said) <= wanted[1])


def _case(name: str, steps: list[str], more: str = "", **said: Any) -> None:
    """Keep the script of these steps and of more, between commas, and what it has to say."""
    CASES[name] = [*steps, *(step for step in more.split(", ") if step)]
    SAID[name] = said


def _stroking(material: str, how: str = "auto", ms: int = 300) -> list[str]:
    slid = [f"touch contact {material}", f"pass {ms} slide {material}"]
    return [f"begin {how}", "pass 1500", *slid]


def _stroke(change: list[str], back: list[str]) -> list[str]:
    steps = [*_stroking("rubber"), "mark"]
    for turn in range(CHANGES):
        steps += [change[turn % len(change)], f"pass {300 + 7 * (turn % 9)} slide rubber"]
        steps += ["say changed by", back[turn % len(back)], "pass 750 slide rubber", "say back by"]
    return [*steps, "say gap gap"]


def _strike(state: str, at_ms: int) -> list[str]:
    """Strike glass so long after the service has changed, or before."""
    steps = [*_stroking("glass"), "touch release glass", "pass 300"]
    steps += [f"service {state}", f"pass {at_ms}"] if at_ms >= 0 else []
    steps += ["mark", "touch contact glass"]
    steps += [f"pass {-at_ms} contact glass", f"service {state}"] if at_ms < 0 else []
    steps += ["pass 160 contact glass", "say felt felt", "say soon soon"]
    return steps + ["say sound heard"] * (at_ms >= 0)


for state in ("dead", "frozen"):
    script = _stroke([f"service {state}"], ["service alive"])
    _case(f"a stroke while it is {state}", script, gap=(0, 50), changed="baked", back="service")
    for at_ms in range(-60, 61, 5):
        script = _strike(state, at_ms)
        after: dict[str, Any] = {"sound": (0.3, 9)} if at_ms >= 0 else {}
        _case(f"a strike {at_ms} ms from {state}", script, felt=(STRIKE, 1), soon=(0, 100), **after)
script = _stroke(["mode baked"], ["mode auto", "mode service"])
_case("a switch by hand", script, gap=(0, 50), changed="baked", back="service")
for how, then in (("", "dead"), (" alone", "alive")):
    _case(
        f"a stop{how}",
        _stroking("stone", f"auto{how}"),
        f"stop, pass 30, mark, service {then}, pass 6000 slide stone, say held felt, "
        "say sound heard, say silence silence, touch release stone, pass 50, mark, "
        "touch contact stone, pass 100, say again felt, say then silence",
        held=NOTHING,
        sound=NOTHING,
        again=(0.5, 1),
        then="",
    )
SAID["a stop"]["silence"] = HELD  # a service that began after it does not know of it
_case(
    "a stop by another",
    _stroking("stone"),
    "stop another, pass 30, mark, service dead, pass 900 slide stone, say held felt, "
    "say sound heard",
    held=NOTHING,
    sound=NOTHING,
)
_case(
    "a stop that comes after a missed strike",
    _stroking("glass"),
    "touch release glass, pass 300, service frozen, mark, touch contact glass, stop left, "
    "service dead, pass 140, say held felt, say sound heard, say silence silence, "
    "touch release glass, touch contact glass, say then silence",
    held=NOTHING,
    sound=NOTHING,
    silence=HELD,
    then="",
)
for how, felt, by in (
    ("auto", SOMETHING, "service"),
    ("auto alone", SOMETHING, "baked"),
    ("baked", SOMETHING, "baked"),
    ("service alone", NOTHING, "service"),
):
    heard = SOMETHING if by == "baked" else NOTHING
    asked = "mark, pass 300 slide stone, say felt felt, say sound heard, say by by, say why silence"
    _case(f"mode {how}", _stroking("stone", how), asked, felt=felt, sound=heard, by=by)
    if felt == SOMETHING:
        SAID[f"mode {how}"]["why"] = ""
_case(
    "a scene beside another",
    _stroking("stone", "auto beside"),
    "mark, pass 900 slide stone, say felt felt, say by by, say because because, own, "
    "pass 500 slide stone, say then by, say gap gap",
    felt=SOMETHING,
    by="baked",
    because="another scene owns the outputs",
    then="service",
    gap=(0, 50),
)
