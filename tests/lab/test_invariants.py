"""Random clients, kills and freezes: what must hold does, and what does not is found."""

import asyncio
import json
import random

import numpy as np
import pytest

from hapticvlm_lab.bench.reliability import invariants
from hapticvlm_lab.bench.reliability.invariants import contradictions
from hapticvlm_lab.bench.reliability.random_clients import (
    ANSWERED_S,
    RandomClient,
    Request,
    random_request,
)

pytestmark = pytest.mark.process

SECONDS = 8.0  # each check comes twice


class Open:
    """A socket that is open."""

    close_code = None


def client(name="anybody"):
    return RandomClient(name, "scene", Open())  # type: ignore[arg-type]


@pytest.mark.nightly
def test_what_must_hold_holds_beside_random_clients(capsys):
    code = invariants.run(minutes=SECONDS / 60.0, seed=7, as_json=True)
    told = json.loads(capsys.readouterr().out)
    assert told["violations"] == []
    assert code == 0
    assert told["descriptors"][2] < 100
    counts = told["counts"]
    assert counts["requests"] > 50
    assert counts["answers"] > 50
    for check in ("owns", "stops", "lapses", "loses"):
        assert counts[f"checked {check}"] >= 1


def test_a_second_answer_and_one_that_never_comes_are_found():
    async def account():
        one = client()
        one.asked[1] = Request(1, "touch", 0.0, asyncio.get_running_loop().create_future())
        one.account({"id": 1, "type": "ok"})
        assert one.faults == []
        one.account({"id": 1, "type": "ok"})
        one.asked[2] = Request(2, "stop", 0.0, asyncio.get_running_loop().create_future())
        return one.faults, one.overdue(ANSWERED_S + 1.0)

    twice, never = asyncio.run(account())
    assert twice == ["anybody: ok answers 1, which awaits no answer"]
    assert never == ["anybody: stop 2 has no answer"]


def test_two_owners_and_one_that_the_service_does_not_know_are_found():
    assert contradictions(["one"], "'one' #3") == []
    assert contradictions([], None) == []
    assert contradictions(["one", "other"], "'one' #3") == ["one and other own the outputs at once"]
    (unknown,) = contradictions(["one"], None)
    assert unknown == "one believes to own the outputs; the status says None"


def test_a_seed_gives_the_same_requests_again():
    def kinds(seed):
        rng = random.Random(seed)
        return [random_request(rng)["type"] for _ in range(200)]

    assert kinds(3) == kinds(3)
    assert kinds(3) != kinds(4)
    assert set(kinds(3)) >= {"touch", "scene", "frame", "set", "stop"}


def an_hour(growth_mb_per_h):
    rng = np.random.default_rng(0)
    at = np.arange(0.0, 3600.0, 5.0)
    warm = 20.0 * np.minimum(1.0, at / 900.0)
    held = 80.0 + warm + growth_mb_per_h * at / 3600.0 + rng.normal(0.0, 0.1, at.size)
    return list(zip(at, held, strict=True))


@pytest.mark.parametrize("growth", [0.0, 10.0])
def test_a_leak_is_seen_as_a_slope_and_warming_up_is_not(growth):
    figures = invariants._growth(an_hour(growth))
    assert figures is not None
    slope, low, high = figures["slope_mb_per_h"]
    assert low <= slope <= high
    assert slope == pytest.approx(growth, abs=0.5)


def test_a_process_that_died_early_has_no_slope():
    assert invariants._growth(an_hour(0.0)[:15]) is None
