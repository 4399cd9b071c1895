"""Compares the plans of a player of `feel.json` with those of the service, case by case."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

Json = dict[str, Any]
GOLDEN: list[Json] = json.loads(
    (Path(__file__).parents[2] / "schemas" / "vectors" / "feel.json").read_text()
)
MAX_OFF = 0.05  # of full scale
MAX_HZ_OFF = 0.05  # of the frequency, or
MAX_HZ = 5.0
# Below a level of 1e-3 a plan is silent, and just above it begins at scale * sqrt(1e-3): 0.070 or
# 0.044. There a difference of a thousandth decides between the two, and no player is better.
EDGE = 0.0705
FELT = 0.1  # amplitude from which a frequency is compared


# Each value that a program gets wrong, as a player is told it, and as the service takes it.
_SPEEDS = {"NaN": 0.0, "Infinity": 20.0, "-Infinity": 0.0, "1e300": 20.0, "-2": 0.0}
_FORCES = {"NaN": 1.5, "Infinity": 200.0, "-Infinity": 0.0, "1e300": 200.0, "-2": 0.0}
WRONG = [("speed_mps", *pair) for pair in _SPEEDS.items()]
WRONG += [("force_n", *pair) for pair in _FORCES.items()]
WORDS = [("phase", "hover"), ("hand", "none"), ("interaction", "rub")]


def _case(kind: str, field: str, value: object) -> Json:
    touch = {"hand": "right", "object_id": "wood", "speed_mps": 0.3, "force_n": 2.0}
    touch |= {"phase": "contact", "interaction": kind, field: value}
    plans = [{"at_s": at_s, "plan": "right"} for at_s in (10.0, 10.05)]
    return {"name": f"{kind} {field} {value}", "events": [{"at_s": 10.0, "touch": touch}, *plans]}


KINDS = ("tap", "press", "slide", "carve", "swing")
HOSTILE = [_case(kind, field, value) for kind in KINDS for field, value, _ in WRONG]
FITTED = [_case(kind, field, value) for kind in KINDS for field, _, value in WRONG]
REFUSED = [_case("slide", field, word) for field, word in WORDS]


def plans(played: list[Json]) -> list[list[Json]]:
    """Return the plans of each case, every number of which is finite."""
    found = [[event for event in case["events"] if "amplitude" in event] for case in played]
    assert "Infinity" not in json.dumps(found)
    assert "NaN" not in json.dumps(found)
    forms = ("amplitude", "parametric")
    return [[{form: event[form] for form in forms} for event in case] for case in found]


def assert_wrong_values_are_fitted(played: list[Json]) -> None:
    """Compare the plans of HOSTILE, FITTED and REFUSED, in this order."""
    found = plans(played)
    count = len(HOSTILE)
    wrong, fitted, refused = found[:count], found[count : 2 * count], found[2 * count :]
    triples = zip(HOSTILE, wrong, fitted, strict=True)
    assert [case["name"] for case, one, other in triples if one != other] == []
    assert len(refused) == len(REFUSED)
    assert not any(event["amplitude"]["amplitude"] for case in refused for event in case)


@dataclass(frozen=True)
class Deviation:
    """Of all plans of one case: the largest deviation of amplitude, of frequency and of onset."""

    name: str
    amplitude: float
    frequency: float  # in multiples of what is permitted
    onset_periods: int
    problems: tuple[str, ...]

    @property
    def is_small(self) -> bool:
        return (
            not self.problems
            and self.amplitude <= MAX_OFF
            and self.frequency <= 1.0
            and self.onset_periods <= 1
        )


def deviations(service: list[Json], player: list[Json]) -> list[Deviation]:
    """Compare what both planned for the same cases; the service's come first."""
    assert [case["name"] for case in service] == [case["name"] for case in player]
    return [_deviation(*pair) for pair in zip(service, player, strict=True)]


def _deviation(service: Json, player: Json) -> Deviation:
    amplitude = frequency = 0.0
    onset = 0
    problems = []
    pairs = list(zip(service["events"], player["events"], strict=True))
    for wanted, played in ((one, other) for one, other in pairs if "plan" in one):
        for form in ("amplitude", "parametric"):
            one, other = wanted[form], played[form]
            if len(one["transients"]) != len(other["transients"]):
                problems.append(f"{wanted['at_s']}: {form}: transients {other['transients']}")
            a, b = _padded(one["amplitude"], other["amplitude"])
            is_edge = ((a == 0.0) | (b == 0.0)) & (np.maximum(a, b) <= EDGE)
            amplitude = max(amplitude, float(np.where(is_edge, 0.0, np.abs(a - b)).max(initial=0)))
            onset = max(onset, _late(a, b), _late(b, a))
            frequency = max(frequency, _off(one, other))
    return Deviation(service["name"], amplitude, frequency, onset, tuple(problems))


def _off(one: Json, other: Json) -> float:
    if len(one["frequency_hz"]) != len(other["frequency_hz"]):
        return 0.0  # the amplitudes tell
    wanted, played = np.array(one["frequency_hz"]), np.array(other["frequency_hz"])
    permitted = np.maximum(MAX_HZ_OFF * wanted, MAX_HZ)
    is_felt = np.array(one["amplitude"])[: wanted.size] >= FELT
    return float((np.abs(wanted - played) / permitted)[is_felt].max(initial=0.0))


def _late(one: Any, other: Any) -> int:
    """Return by how many periods `other` is felt later than `one`, within the permitted error."""
    begins = np.flatnonzero(one > FELT)
    follows = np.flatnonzero(other > FELT - MAX_OFF)
    if not begins.size:
        return 0
    return int(max(0, (follows[0] if follows.size else one.size) - begins[0]))


def _padded(*lists: list[float]) -> list[Any]:
    size = max(map(len, lists))
    return [np.pad(np.array(values, dtype=float), (0, size - len(values))) for values in lists]
