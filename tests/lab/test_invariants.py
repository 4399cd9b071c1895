"""Random clients, kills and freezes: what must hold does, and what does not is found."""

import asyncio
import json
import random

import pytest

from hapticvlm_lab.bench.reliability import invariants
from hapticvlm_lab.bench.reliability.invariants import contradictions
from hapticvlm_lab.bench.reliability.strangers import ANSWERED_S, Asked, Stranger, act

pytestmark = pytest.mark.process

SECONDS = 8.0  # each check comes twice


class Open:
    """A socket that is open."""

    close_code = None


def stranger(name="anybody"):
    return Stranger(name, "scene", Open())  # type: ignore[arg-type]


def test_what_must_hold_holds_beside_random_clients(capsys):
    code = invariants.run(minutes=SECONDS / 60.0, seed=7, as_json=True)
    told = json.loads(capsys.readouterr().out)
    assert told["violations"] == []
    assert code == 0
    counts = told["counts"]
    assert counts["requests"] > 200
    assert counts["answers"] > 200
    for check in ("owns", "stops", "lapses", "loses"):
        assert counts[f"checked {check}"] >= 1


def test_a_second_answer_and_one_that_never_comes_are_found():
    async def account():
        one = stranger()
        one.asked[1] = Asked(1, "touch", 0.0, asyncio.get_running_loop().create_future())
        one.account({"id": 1, "type": "ok"})
        assert one.faults == []
        one.account({"id": 1, "type": "ok"})
        one.asked[2] = Asked(2, "stop", 0.0, asyncio.get_running_loop().create_future())
        return one.faults, one.overdue(ANSWERED_S + 1.0)

    twice, never = asyncio.run(account())
    assert twice == ["anybody: ok answers 1, which waits for nothing"]
    assert never == ["anybody: stop 2 has no answer"]


def test_two_owners_and_one_that_the_service_does_not_know_are_found():
    assert contradictions(["one"], "'one' #3") == []
    assert contradictions([], None) == []
    assert contradictions(["one", "other"], "'one' #3") == ["one and other own the outputs at once"]
    (unknown,) = contradictions(["one"], None)
    assert unknown == "one thinks that it owns the outputs; the status says None"


def test_a_seed_gives_the_same_requests_again():
    def kinds(seed):
        rng = random.Random(seed)
        return [act(rng)["type"] for _ in range(200)]

    assert kinds(3) == kinds(3)
    assert kinds(3) != kinds(4)
    assert set(kinds(3)) >= {"touch", "scene", "frame", "set", "stop"}
