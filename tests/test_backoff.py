"""Tests back-off and circuit breaker, with the time as an argument."""

import pytest

from hapticvlm.backoff import (
    FIRST_REST_S,
    JITTER,
    MAX_REST_S,
    OPEN_S,
    TRIP,
    Breaker,
    pause_s,
)


def after(failures: int, dice: float = 0.0) -> Breaker:
    """Fail so many times, each as soon as the last rest has ended, from 100 s on."""
    breaker, now = Breaker(), 100.0
    for _ in range(failures):
        now += breaker.rest_s(now)
        breaker = breaker.failed(now, "down", dice=dice, requested_s=None)
    return breaker


def rest(breaker: Breaker, before: Breaker) -> float:
    return breaker.rests_until - (before.rests_until or 100.0)


def test_an_endpoint_that_never_failed_may_be_asked() -> None:
    assert Breaker().rest_s(0.0) == 0.0
    assert Breaker().state(0.0) == "closed"


@pytest.mark.parametrize("failures", range(1, TRIP))
def test_each_failure_doubles_the_rest(failures: int) -> None:
    one, before = after(failures), after(failures - 1)
    assert rest(one, before) == pytest.approx(FIRST_REST_S * 2 ** (failures - 1))
    assert one.state(one.rests_until - 0.01) == "closed"


def test_jitter_stretches_a_rest_and_never_shortens_it() -> None:
    assert after(1, dice=1.0).rests_until == pytest.approx(100 + FIRST_REST_S * (1 + JITTER))
    assert after(1, dice=0.0).rests_until == pytest.approx(100 + FIRST_REST_S)


def test_the_circuit_opens_after_failures_in_a_row_and_lets_one_through_later() -> None:
    tripped = after(TRIP)
    opened = tripped.rests_until - OPEN_S
    assert tripped.state(opened) == "open"
    assert tripped.rest_s(opened) == pytest.approx(OPEN_S)
    assert tripped.state(opened + OPEN_S) == "half-open"
    assert tripped.rest_s(opened + OPEN_S) == 0.0


def test_a_failure_of_the_one_let_through_opens_the_circuit_again() -> None:
    again = after(TRIP + 1)
    assert again.state(again.rests_until - 1.0) == "open"
    assert rest(again, after(TRIP)) == pytest.approx(OPEN_S)


def test_an_answer_closes_the_circuit_and_forgets() -> None:
    healed = after(TRIP).succeeded()
    assert healed == Breaker()
    assert healed.failed(0.0, "down", dice=0.0, requested_s=None).rest_s(0.0) == FIRST_REST_S


def test_an_endpoint_is_given_the_rest_it_asks_for_within_reason() -> None:
    polite = Breaker().failed(0.0, "busy", dice=0.0, requested_s=12.0)
    assert polite.rest_s(0.0) == 12.0
    greedy = Breaker().failed(0.0, "busy", dice=0.0, requested_s=1e9)
    assert greedy.rest_s(0.0) == MAX_REST_S
    assert Breaker().failed(0.0, "busy", dice=0.0, requested_s=0.0).rest_s(0.0) == FIRST_REST_S


def test_pauses_double_from_the_first_to_the_longest_and_no_failure_pauses() -> None:
    assert [pause_s(failures, 1.0, 30.0) for failures in range(8)] == [0, 1, 2, 4, 8, 16, 30, 30]
    assert pause_s(10**6, 10.0, 300.0) == 300.0
