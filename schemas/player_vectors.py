"""Golden vectors of the players of a feel file, and the hostile cases that they refuse.

The golden ones are those of the reference player (`examples/bake_player.py`), which
`tests/rendering/test_bake_player.py` compares with the service. A player of another language plays
the same touches from `vectors/feel.true.json` and `vectors/feel.sound.json`. `problems` compares.
"""

from __future__ import annotations

import json
import math
import re
import sys
from collections.abc import Iterator
from functools import lru_cache
from itertools import pairwise, product
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from hapticvlm import partial_messages
from hapticvlm.materials import MATERIALS
from hapticvlm.messages import MessageError, Touch
from hapticvlm.rendering.vibration import feel_clips
from hapticvlm.rendering.vibration.vibration import INTERACTIONS, VOICES

sys.path.insert(0, str(Path(__file__).parents[1] / "examples"))
from bake_player import Player
from feel_file import opened

import feel_vectors

Json = dict[str, Any]
Wave = NDArray[np.float64]
RATE_HZ = 12_000
BLOCK = 120  # samples of one call of `render`: 10 ms
WINDOW = 600  # samples of one level: 50 ms
BLOCKS = 50
RENEWED = 4  # blocks between two touches
LOWEST_HZ = 25.0
BANDS = 24  # third octaves
QUIET_DB = -70.0  # a weaker window is not compared
STEP_DB = 1.6  # of a palm, in the strongest third octave: in 99 % of windows
MOST_DB = 3.0
MOST_PITCH = 0.05
MOST_ONSET_S = 0.002
MOST_AMPLITUDE = 0.02  # of full scale, of a plan
_OF_SURFACES = ("material", "impact_gain", "thickness_m", "hum")
MOTION = {"speed_mps": 0.4, "force_n": 1.5}


@lru_cache(maxsize=2)
def file_of(voice: str) -> Json:
    """Return the feel file of the built-in materials, parsed."""
    return dict(json.loads(feel_clips.encode(feel_clips.feel(MATERIALS, voice))))


@lru_cache(maxsize=2)
def _feel(voice: str) -> Json:
    return opened(file_of(voice))


def plans() -> Iterator[Json]:
    """Yield events (a touch, a stop, or a plan of a hand) with the reference player's plans.

    One player gives the plans of `amplitude` and another those of `parametric`.
    """
    for material in MATERIALS:
        for interaction in INTERACTIONS:
            yield planned(feel_vectors.touched(material, interaction, 0.4))
    yield planned(feel_vectors.changing_speed())
    yield planned(feel_vectors.lapsing())
    yield planned(feel_vectors.stopped())
    yield planned(feel_vectors.both_hands())
    yield planned(feel_vectors.crowded())
    yield planned(feel_vectors.swung_and_struck())
    yield planned(feel_vectors.many_textures())
    yield planned(feel_vectors.kneaded())
    for hz, drives in ((50.0, [0.4, 0.1]), (8.0, [0.4]), (600.0, [0.1, 0.4])):
        yield planned(_humming(hz, drives))


def planned(case: Json) -> Json:
    """Return a case with the reference player's plans in its `plan` events."""
    surfaces = case.get("surfaces", {})
    players = {
        form: Player(_feel("true"), lambda touch: _surface(touch, surfaces), say=str)
        for form in feel_vectors.FORMS
    }
    events = []
    for event in case["events"]:
        for form, player in players.items():
            if "touch" in event:
                player.touch(event["touch"], event["at_s"])
            elif "stop" in event:
                player.stop()
            else:
                plan = player.plan(event["plan"], form, event["at_s"])
                event = {**event, form: plan}
        events.append(event)
    return {**case, "events": events}


def plan_problems(case: Json, played: Json) -> list[str]:
    """Return a sentence for each plan of a player that is off, for a case of `plans`."""
    plans = [
        (event["at_s"], form, event[form], own[form])
        for event, own in zip(case["events"], played["events"], strict=True)
        for form in (feel_vectors.FORMS if "plan" in event else ())
    ]
    return [
        f"{case['name']} {at_s} {form}: {own}, not {wanted}"
        for at_s, form, wanted, own in plans
        if own["period_ms"] != wanted["period_ms"]
        or not _are_near(_plan_numbers(wanted), _plan_numbers(own))
    ]


def _are_near(wanted: tuple[Wave, Wave], own: tuple[Wave, Wave]) -> bool:
    if [part.size for part in wanted] != [part.size for part in own]:
        return False
    (amplitude, hertz), (own_amplitude, own_hertz) = wanted, own
    return bool(
        (abs(own_amplitude - amplitude) <= MOST_AMPLITUDE).all()
        and (abs(own_hertz - hertz) <= MOST_PITCH * hertz).all()
    )


def _plan_numbers(plan: Json) -> tuple[Wave, Wave]:
    """Return all amplitudes of a plan, and all frequencies."""
    amplitudes = [*plan["amplitude"], *(one["amplitude"] for one in plan["transients"])]
    hertz = [*plan["frequency_hz"], *(one["frequency_hz"] for one in plan["transients"])]
    return np.array(amplitudes, dtype=float), np.array(hertz, dtype=float)


def sounds() -> Iterator[Json]:
    """Yield touches by block, and the level of each 50 ms of what the reference player renders."""
    for voice in VOICES:
        for material in MATERIALS:
            for interaction in INTERACTIONS:
                yield heard(_rendered(voice, material, interaction))
        hum = {"frequency_hz": 120.0, "level": 0.5, "drives": [0.4, 0.1]}
        case = _rendered(voice, "fridge", "slide")
        yield heard({**case, "name": f"{voice} hum", "surfaces": {"fridge": {"hum": hum}}})


def heard(case: Json) -> Json:
    """Return a case with its onset and its levels."""
    wave = rendered(_feel(case["voice"]), case)
    return {**case, "onset_s": onset_s(wave), "levels": levels(wave)}


def rendered(feel: Json, case: Json) -> Wave:
    """Return the samples of a case by the reference player, (blocks * BLOCK,)."""
    player = Player(feel, lambda touch: _surface(touch, case.get("surfaces")), RATE_HZ, str)
    wave = []
    for block in range(case["blocks"]):
        now = block * BLOCK / RATE_HZ
        for each in (one for one in case["touches"] if one["block"] == block):
            player.touch(each["touch"], now)
        wave.append(player.render(BLOCK, now))
    return np.concatenate(wave)


def levels(wave: Wave) -> list[list[float] | None]:
    """Return the level of the strongest third octave, dB, and the pitch, Hz, of each 50 ms."""
    return [_level(part) for part in wave.reshape(-1, WINDOW)]


def onset_s(wave: Wave) -> float:
    """Return when a wave first reaches a tenth of its largest sample, s; 0 for silence."""
    return float(np.argmax(np.abs(wave) >= 0.1 * np.abs(wave).max())) / RATE_HZ


def problems(case: Json, wave: Wave) -> list[str]:
    """Return a sentence for each window of a player's samples that is off, for a case of `sounds`.

    A window that is off by STEP_DB to MOST_DB begins with `step`: one in a hundred may be.
    """
    found = []
    for at, (wanted, played) in enumerate(zip(case["levels"], levels(wave), strict=True)):
        if wanted is None or played is None:
            if wanted != played and (wanted or played or [0.0])[0] > QUIET_DB + MOST_DB:
                found.append(f"{case['name']} {at}: {played}, not {wanted}")
            continue
        off_db = abs(played[0] - wanted[0])
        if off_db > STEP_DB:
            kind = "step " if off_db <= MOST_DB else ""
            found.append(f"{kind}{case['name']} {at}: {played[0]} dB, not {wanted[0]}")
        if abs(played[1] / wanted[1] - 1.0) > MOST_PITCH:
            found.append(f"{case['name']} {at}: {played[1]} Hz, not {wanted[1]}")
    if abs(onset_s(wave) - case["onset_s"]) > MOST_ONSET_S:
        found.append(f"{case['name']}: begins at {onset_s(wave)} s, not {case['onset_s']}")
    return found


def hostile() -> Json:
    """Return the cases that every player meets as the service does, and files that it refuses."""
    wrong = (None, "middle", "__proto__", "")
    calls = [{"hand": hand, "form": "amplitude", "says": "hand"} for hand in wrong]
    calls += [{"hand": "right", "form": form, "says": "form"} for form in wrong]
    return {
        "touches": [*_hostile_touches()],
        "times": _hostile_times(),
        "calls": calls,
        "files": [*_broken()],
    }


def grid() -> list[Json]:
    """Return cases of touches in which each field has each value that strangers send."""
    marked = [{"$number": name} for name in ("NaN", "Infinity", "-Infinity")]
    numbers = [*marked, None, -1.0, 1e300]
    values = [*numbers, 5000, True, "", "fast", "__proto__", [], [None], {}]
    hum: Json = {"frequency_hz": 50, "level": 1, "drives": [0.5]}
    surfaces: list[Json] = [{name: value} for name in _OF_SURFACES for value in values]
    surfaces += [{"hum": {**hum, name: value}} for name in hum for value in values]
    cases: list[Json] = []
    for phase, kind in product(("approach", "contact", "slide"), (None, "press", "swing")):
        touch: Json = {"phase": phase, "hand": "left", "object_id": "cup", "interaction": kind}
        touch |= MOTION
        touches: list[Json] = [{name: value} for name in (*touch, "surface") for value in values]
        touches += [{"speed_mps": v, "force_n": n} for v, n in product(numbers, numbers)]
        cases += [{"touch": {**touch, **fields}} for fields in touches]
        if kind:
            cases += [{"touch": touch, "surface": {"material": "wood", **one}} for one in surfaces]
    cases += [{"touch": touch, "gain": value} for value in values]
    return [{"like": None, **case} for case in cases]


def is_in_range(plan: Json) -> bool:
    """Return whether each number of a plan is finite and in its range."""
    amplitude = plan["amplitude"] + [one["amplitude"] for one in plan["transients"]]
    hertz = plan["frequency_hz"] + [one["frequency_hz"] for one in plan["transients"]]
    pairs = [*((value, 1.0) for value in amplitude), *((value, 1000.0) for value in hertz)]
    return all(isinstance(value, int | float) and 0.0 <= value <= most for value, most in pairs)


def unmarked(value: Any) -> Any:
    """Return a hostile value: {"$number": "NaN"} stands for a number that JSON has not."""
    if isinstance(value, list):
        return [unmarked(part) for part in value]
    if isinstance(value, dict):
        if set(value) == {"$number"}:
            return float(value["$number"])
        return {name: unmarked(part) for name, part in value.items()}
    return value


def says(case: Json) -> list[Json]:
    """Return what a player tells in a hostile case, as `said` has it."""
    return [{"field": case["says"], "range": case.get("range")}] if case["says"] else []


def said(texts: list[str]) -> list[Json]:
    """Return the field that each text of a player names, and the range that it states."""
    found = [re.match(r"([^:]+): (?:.* outside (\S+) to (\S+);)?", text) for text in texts]
    fields = [one.groups() for one in found if one]
    return [
        {"field": field, "range": low and [float(low), float(high)]} for field, low, high in fields
    ]


def edited(file: Json, case: Json) -> Any:
    """Return a copy of a feel file with the edit of a case of `files`."""
    if "file" in case:
        return case["file"]
    copied = json.loads(json.dumps(file))
    *way, last = case["path"]
    part = copied
    for step in way:
        part = part[step]
    if "value" in case:
        part[last] = unmarked(case["value"])
    else:
        del part[last]
    return copied


def _hostile_touches() -> Iterator[Json]:
    """Yield a touch or surface, and the one that it is felt like; null: it is refused."""
    nan, most, least = ({"$number": name} for name in ("NaN", "Infinity", "-Infinity"))
    defaults = {"speed_mps": 0.0, "force_n": 1.5}
    ranges = file_of("true")["ranges"]
    for name, default in defaults.items():
        low, high = ranges[name]
        for no_number in (nan, "fast", True):
            yield _hostile({name: no_number}, {name: default}, says=name)
        for value, like in ((most, high), (least, low), (-1.0, low), (1e30, high)):
            yield {**_hostile({name: value}, {name: like}, says=name), "range": [low, high]}
        yield _hostile({name: None}, {name: default})
    refused: tuple[tuple[str, tuple[str | None, ...]], ...] = (
        ("phase", ("hover", "Contact", "", None)),
        ("hand", ("none", "middle", "__proto__", None)),
        ("interaction", ("Slide", "rub")),
    )
    for name, words in refused:
        for word in words:
            yield _hostile({name: word}, None, says=name)
    yield _hostile({"interaction": None}, {})
    yield _hostile({"surface": None, "region": None, "object_id": None}, {})
    yield from _hostile_surfaces(nan, ranges)


def _hostile_surfaces(nan: Json, ranges: Json) -> Iterator[Json]:
    """Yield a surface or a gain of a player, and the one that it is felt like."""
    for name, value, like, says in (
        ("impact_gain", nan, 1.0, "impact_gain"),
        ("impact_gain", 100, 1.0, "impact_gain"),
        ("impact_gain", -5, 0.0, "impact_gain"),
        ("impact_gain", None, 1.0, None),
        ("thickness_m", None, None, None),
        ("thickness_m", nan, None, "thickness_m"),
        ("thickness_m", 0, ranges["thickness_m"][0], "thickness_m"),
        ("hum", None, None, None),
        ("hum", {"frequency_hz": None, "level": 1, "drives": [1]}, None, "hum"),
        ("hum", {"frequency_hz": 50, "level": 1}, None, "hum"),
        *(
            ("hum", {"frequency_hz": 50, "level": level, "drives": drives}, None, "hum")
            for level, drives in ((1, [nan]), (1, [-100.5]), (1, [0.1] * 17), (0, [0.4]))
        ),
        ("material", "Wood", None, "material"),
        ("material", "__proto__", None, "material"),
        ("material", 7, None, "material"),
        ("material", None, None, None),
        ("material", "unknown", None, None),
    ):
        kind = "swing" if name == "thickness_m" else "strike"
        case = _hostile({"interaction": kind}, {"interaction": kind}, says=says)
        if name == "thickness_m":
            for part in ("touch", "like"):
                case[part] = {**case[part], "phase": "approach"}
        case["surface"] = {"material": "wood", name: value}
        case["like_surface"] = {"material": "wood", name: like}
        if type(value) is int and name in ranges:
            case["range"] = ranges[name]
        yield {**case, "name": f"surface {name} {json.dumps(value)}"}
    for value, like in ((nan, 1.0), (50, 1.0), (-1, 0.0), (None, 1.0)):
        case = _hostile({}, {}, says=None if value is None else "gain")
        if type(value) is int:
            case["range"] = ranges["gain"]
        yield {**case, "name": f"gain {json.dumps(value)}", "gain": value, "like_gain": like}


def _hostile(fields: Json, like: Json | None, says: str | None = None) -> Json:
    touch = {"phase": "contact", "hand": "right", "object_id": "cup", **MOTION}
    case: Json = {"name": f"touch {json.dumps(fields)}", "touch": {**touch, **fields}}
    case["like"] = None if like is None else {**touch, **like}
    return {**case, "says": says, "service": _of_the_service(unmarked(case["touch"]))}


def _of_the_service(touch: Json) -> Json | None:
    """Return speed and force as the service takes them; null: it refuses the touch."""
    message = {"type": "touch", "id": 1, "captured_at": 0.0, **touch}
    message = {name: value for name, value in message.items() if value is not None}
    try:
        taken = partial_messages.decode(msgspec.msgpack.encode(message), MATERIALS).message
    except MessageError:
        return None
    assert isinstance(taken, Touch)
    return {"speed_mps": taken.speed_mps, "force_n": taken.force_n}


def _hostile_times() -> list[Json]:
    """Return times of a slide's touches, and the field that a player names; none is an error."""
    return [
        *(
            {
                "name": f"each {gap} of {times}",
                "times": [gap * n for n in range(times)],
                "says": says,
            }
            for gap, times, says in (
                (16.0, 8, "now"),
                (16.0, 3, None),
                (5.0, 4, "now"),
                (4.9, 8, None),
                (1000.0, 4, "now"),
                (1001.0, 8, None),
            )
        ),
        {"name": "pauses", "times": [0.0, 16.0, 32.0, 32.1, 48.0, 64.0, 64.1], "says": None},
        {"name": "taps", "times": [16.0 * n for n in range(8)], "says": None, "phase": "contact"},
        {"name": "not a number", "times": [{"$number": "NaN"}], "says": "now"},
        {"name": "infinite", "times": [{"$number": "Infinity"}], "says": "now"},
        {"name": "null", "times": [None], "says": "now"},
        {"name": "back", "times": [10.0, 10.02, 9.0, 9.02], "says": None},
        {"name": "a year later", "times": [0.0, 3e7, 3e7], "says": None},
    ]


def _broken() -> Iterator[Json]:
    """Yield files that are refused, and the field that the error names."""
    yield {"name": "null", "file": None, "field": "the file"}
    yield {"name": "a list", "file": [], "field": "the file"}
    yield {"name": "empty", "file": {}, "field": "version"}
    yield {"name": "version 1", "path": ["version"], "value": 1, "field": "version"}
    yield {"name": "another voice", "path": ["voice"], "value": "loud", "field": "voice"}
    nan, infinite = {"$number": "NaN"}, {"$number": "Infinity"}
    numbers: tuple[tuple[list[Any], Any], ...] = (
        (["rules", "lease_s"], 1e9),
        (["rules", "lease_s"], "x"),
        (["ranges", "impact_gain", 1], -1),
        (["rules", "step_s"], 0),
        (["rules", "step_s"], 0.1),
        (["rules", "pad", "period_s", "parametric"], 0.001),
        (["rules", "pad", "horizon_s"], 0.01),
        (["rules", "step_s"], nan),
        (["rules", "fade_s"], -1),
        (["rules", "ceiling"], 1000),
        (["rules", "ceiling"], 0),
        (["rules", "grains_per_s"], infinite),
        (["rules", "pad", "period_s", "amplitude"], 0),
        (["rules", "pad", "horizon_s"], 1e9),
        (["rules", "pad", "scale", "parametric"], 1e9),
        (["materials", "wood", "n_per_grain"], 0),
        (["materials", "wood", "carve", "breaks", "per_s", 3], 1e9),
        (["levels", "slide", 2, 1], True),
        (["impacts", "tap", "palm", 0, 0], None),
        (["clips", "wood grain", "rate_hz"], 1e9),
        (["clips", "wood grain", "peak"], nan),
        (["clips", "wood grain", "most"], 0),
        (["loops", "wood relief", "rate", 0], -1),
        (["speeds_mps", 3], -1),
    )
    for path, value in numbers:
        field = ".".join(str(step) for step in path)
        yield {"name": f"{field} {json.dumps(value)}", "path": path, "value": value, "field": field}
    sound = file_of("sound")["rules"]["sound"]
    layer = ["materials", "wood", "slide", "layers", 0]
    others: tuple[tuple[list[Any], Any, str], ...] = (
        (["speeds_mps", 3], 0.01, "speeds_mps"),
        (["clips", "wood grain", "wave"], "", "clips.wood grain.wave"),
        (["clips", "wood grain", "wave"], "!!", "clips.wood grain.wave"),
        (["loops", "wood relief", "wave"], "gA==", "loops.wood relief.wave"),
        (["clips", "wood grain", "drive", "bytes"], None, "clips.wood grain.drive.bytes"),
        (["materials", "wood", "grain"], "oak grain", "materials.wood.grain"),
        (["clips", "wood 1 2", "rate_hz"], 8000, "materials.wood.tap.clips"),
        (["materials", "wood", "tap", "clips"], ["oak"], "materials.wood.tap.clips.0"),
        ([*layer, "loop"], "__proto__", "materials.wood.slide.layers.0.loop"),
        ([*layer, "level"], "rough", "materials.wood.slide.layers.0.level"),
        (["levels", "slide", 2], [], "levels.slide.2"),
        (["words", "phase"], "contact", "words.phase"),
        (["words"], {}, "words.phase"),
        (["words", "hand"], [], "words.hand"),
        (["words", "hand"], ["left", "LEFT"], "words.hand"),
        (["ranges"], {}, "ranges.speed_mps"),
        (["impacts"], {}, "impacts.tap"),
        (["rules", "pad", "period_s"], {}, "rules.pad.period_s.amplitude"),
        (["rules", "pad", "scale"], {}, "rules.pad.scale.amplitude"),
        (["rules", "pad", "hum_hz"], [50.0], "rules.pad.hum_hz"),
        (["rules", "pad", "hum_hz", 3], 40.0, "rules.pad.hum_hz"),
        (["rules", "pad", "hum_felt"], [1.0], "rules.pad.hum_felt"),
        (["rules", "sound"], {**sound, "hum_weight": [1.0]}, "rules.sound.hum_weight"),
        (["materials", "wood", "thickness_m"], None, "materials.wood.thickness_m"),
    )
    for path, value, field in others:
        yield {"name": f"{field} {json.dumps(value)}", "path": path, "value": value, "field": field}
    for path in (["rules"], ["materials", "wood", "slide"], ["clips"]):
        yield {"name": f"without {'.'.join(path)}", "path": path, "field": ".".join(path)}


def _rendered(voice: str, material: str, interaction: str) -> Json:
    touches = []
    for block in range(0, BLOCKS, RENEWED):
        phase = "contact" if not block or interaction in ("tap", "strike", "press") else "slide"
        motion = dict(MOTION)
        if interaction == "press":
            motion = {"speed_mps": 0.0 if block else 0.4, "force_n": 1.5 + 0.1 * block}
        if interaction == "swing":
            phase, motion = "approach", {"speed_mps": 2.4, "force_n": 0.0}
        touch = {"phase": phase, "hand": "right", "object_id": material, "interaction": interaction}
        touches.append({"block": block, "touch": {**touch, **motion}})
    name = f"{voice} {material} {interaction}"
    return {"name": name, "voice": voice, "blocks": BLOCKS, "touches": touches}


def _humming(hz: float, drives: list[float]) -> Json:
    hum = {"frequency_hz": hz, "level": 0.5, "drives": drives}
    surface = {"material": "metal", "hum": hum}
    events: list[Json] = []
    for number in range(5):
        touch = {"phase": "contact", "hand": "left", "object_id": "fridge", **MOTION}
        events.append({"at_s": 10.0 + 0.04 * number, "touch": touch})
        events.append({"at_s": 10.0 + 0.04 * number, "plan": "left"})
    return {
        "name": f"a hand on a fridge that runs at {hz:g} Hz",
        "surfaces": {"fridge": surface},
        "events": events,
    }


def _surface(touch: Json, surfaces: Json | None = None) -> Json:
    name = str(touch.get("object_id"))
    return dict((surfaces or {}).get(name, {"material": name}))


def _level(part: Wave) -> list[float] | None:
    power = np.abs(np.fft.rfft(part * np.hanning(part.size))) ** 2
    hertz = np.fft.rfftfreq(part.size, 1.0 / RATE_HZ)
    edges = LOWEST_HZ * 2.0 ** ((np.arange(BANDS + 1) - 0.5) / 3.0)
    begins = np.searchsorted(hertz, edges)
    bands = [float(power[begin:end].sum()) for begin, end in pairwise(begins)]
    strongest_db = 10.0 * math.log10(max(bands) * 16.0 / 3.0 / part.size**2 + 1e-30)
    if strongest_db < QUIET_DB:
        return None
    pitch = float((power * hertz).sum() / power.sum())
    return [round(strongest_db, 2), round(pitch, 1)]
