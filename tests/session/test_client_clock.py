"""Clocks of clients that stand still, run slow or jump: strikes are felt all the same."""

import pytest
from session_messages import TABLE, frame, only, owner, touch

from hapticvlm.session.actions import PlayVibration
from hapticvlm.session.frames import ClockOffset
from hapticvlm.session.targets import RecognitionRequest

STRIKES = 100
EVERY_S = 0.3


def silent_strikes(clock, held_up_s=None):
    """Strike again and again; return the numbers of the strikes that made no impact."""
    session = owner(TABLE)
    silent = []
    for number in range(STRIKES):
        at = number * EVERY_S
        arrived = 1000.0 + at + (held_up_s(at) if held_up_s else 0.0)
        session.receive(touch("release", at=clock(at)), arrived)
        actions = session.receive(touch(at=clock(at + 0.001)), arrived + 0.001)
        if not any(feel.command.onset for feel in only(actions, PlayVibration)):
            silent.append(number)
    return silent


@pytest.mark.parametrize("still_s", [0.4, 5.0, 3600.0])
def test_after_a_clock_stood_still_one_strike_is_lost(still_s):
    silent = silent_strikes(lambda at: 100.0 + at - (still_s if at > 10.0 else 0.0))
    assert len(silent) <= (1 if still_s < 60 else 0)


@pytest.mark.parametrize("speed", [0.1, 0.3, 0.5, 0.9])
def test_of_a_clock_that_runs_slow_few_strikes_are_lost(speed):
    assert len(silent_strikes(lambda at: 100.0 + speed * at)) <= 4


def test_a_clock_that_pauses_and_goes_on_loses_few_strikes():
    def paused(at):
        return 100.0 + (at if at < 3.0 else 3.0 if at < 6.0 else at - 3.0)

    assert len(silent_strikes(paused)) <= 3


def test_the_fastest_trip_is_forgotten_after_one_to_two_windows():
    clock = ClockOffset()
    ages_s = []
    for second in range(0, 27, 3):
        clock.observe(second, second + (0.05 if second else 0.0))
        ages_s.append(round(clock.age_s(second, second + 0.05), 6))
    assert ages_s == [0.05] * 8 + [0.0]


@pytest.mark.parametrize("scale", [1000.0, 1.0])
def test_milliseconds_and_jumps_ahead_lose_none(scale):
    assert silent_strikes(lambda at: scale * at + (5e3 if at > 10.0 else 0.0)) == []


@pytest.mark.parametrize("catches_up_s", [0.0, 2.2])
def test_contacts_that_were_held_up_on_their_way_make_no_impact(catches_up_s):
    def held_up_s(at):  # from 10 to 12 s nothing arrives, then all of it, at once or in a hurry
        return max(0.0, 12.0 - at + catches_up_s / 4.0 * (at - 10.0)) if at > 10.0 else 0.0

    silent = silent_strikes(lambda at: 100.0 + at, held_up_s)
    late = [number for number in range(STRIKES) if held_up_s(number * EVERY_S) > 0.25]
    assert silent == late


def test_frames_of_a_slow_clock_are_not_called_stale_for_ever():
    session = owner(TABLE)
    stale = 0
    for number in range(100):
        shown = frame(object_id="thing", at=100.0 + 0.03 * number, max_age_ms=300.0)
        look = only(session.receive(shown, 1000.0 + 0.1 * number), RecognitionRequest)
        assert look
        stale += session.is_stale(shown, 1000.0 + 0.1 * number)
    assert stale < 10
