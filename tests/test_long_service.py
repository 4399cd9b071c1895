"""After a hundred days clocks and counters are large, and everything is as on the first day."""

import sys

import msgspec
import numpy as np
import pytest

from hapticvlm.devices.plate.session import BoardClock
from hapticvlm.devices.speaker.ring import Release, Ring
from hapticvlm.messages import Scene, SceneObject, Touch
from hapticvlm.recordings.recorded_session import outputs
from hapticvlm.rendering.heat.limits import AT_REST
from hapticvlm.rendering.vibration.vibration import Motion
from hapticvlm.rendering.vibration.voices import Command, Voices
from hapticvlm.server.edge.limits import MESSAGES, TokenBucket
from hapticvlm.server.web import metrics
from hapticvlm.session.session import SceneSession
from hapticvlm.session.settings import SessionSettings

HUNDRED_DAYS_S = 100 * 86_400.0
STEP_S = 1 / 64  # exact in binary, at any of these times: so outputs can be equal to the last bit
WRAP_MS = 2**32  # of the board's clock, after 49.7 days
MUG = SceneObject(object_id="mug", material="ceramic", temperature_c=45.0)


def touched_at(start_s):
    """Return the outputs of a touch that begins at this time of the clock, and lapses."""
    session = SceneSession(SessionSettings(owner=True))
    actions = session.receive(Scene(id=1, objects=[MUG], replace=True), start_s)
    for step in range(100):
        now = start_s + step * STEP_S
        if step % 4 == 0 and step < 60:
            touch = Touch(
                id=step + 2,
                phase="approach" if step < 12 else "contact",
                object_id="mug",
                hand="right",
                speed_mps=0.3,
                force_n=1.0,
                captured_at=now,
            )
            actions += session.receive(touch, now)
        actions += session.tick(now, AT_REST)
    return shifted(msgspec.to_builtins(outputs(actions)), start_s)


def shifted(lines, start_s):
    """Return lines of outputs with the times of commands counted from the start."""
    for line in lines:
        if "command" in line:
            line["command"]["expires_at"] -= start_s
    return lines


def test_a_touch_has_the_same_outputs_to_the_last_bit():
    first = touched_at(0.0)
    assert {line["do"] for line in first} >= {"play_vibration", "drive_plate", "release_hand"}
    assert touched_at(HUNDRED_DAYS_S) == first


def felt_at(start_s):
    voices = Voices(1.0, fills_caches=False)
    command = Command(
        hand=1,
        material="wood",
        interaction="strike",
        onset=True,
        motion=Motion(0.3, 1.0),
        seed=1,
        expires_at=start_s + 16 * STEP_S,
    )
    voices.apply(command)
    return np.concatenate([voices.render(750, start_s + block * STEP_S) for block in range(32)])


def test_a_vibration_is_rendered_the_same_to_the_last_bit():
    assert np.array_equal(felt_at(0.0), felt_at(HUNDRED_DAYS_S))


def test_orders_reach_the_engine_past_the_largest_number_of_32_bits():
    ring = Ring.create()
    ring._view[:8] = (2**32 - 2).to_bytes(8, sys.byteorder)
    numbers = [ring.put(Release(hand), HUNDRED_DAYS_S) for hand in (0, 1, 0)]
    orders = list(ring.take(2**32 - 2))
    assert numbers == [2**32 - 1, 2**32, 2**32 + 1]
    assert orders == [
        (n, HUNDRED_DAYS_S, Release(h)) for n, h in zip(numbers, (0, 1, 0), strict=True)
    ]


def test_a_rate_is_limited_as_on_the_first_day():
    passed = []
    for start_s in (0.0, HUNDRED_DAYS_S):
        bucket = TokenBucket(MESSAGES, start_s)
        passed.append([bucket.spend(1, start_s + step * 2.0**-12) for step in range(20_000)])
    assert passed[0] == passed[1]
    assert False in passed[0]


def test_the_clock_of_a_board_that_wraps_is_not_wrong():
    clock = BoardClock()
    start_s = HUNDRED_DAYS_S
    clock.note(0, start_s)
    seconds = np.arange(WRAP_MS / 1000.0 - 100.0, WRAP_MS / 1000.0 + 100.0, 0.1)
    for after_s in seconds:
        clock.note(int(1000 * after_s) % WRAP_MS, start_s + after_s)
        assert not clock.is_wrong, after_s


@pytest.mark.parametrize("count", [2**32 + 1, 100 * 86_400 * 400])
def test_a_count_beyond_32_bits_is_reported_exactly(count):
    status = {
        "connections": 1,
        "leases": 0,
        "speaker": {
            "level": 0.0,
            "underruns": count,
            "lost_commands": 0,
            "restarts": 0,
            "faults": (),
        },
        "plate": {"plate_c": None, "setpoint_c": None, "dose_cem43": 0.0, "faults": ()},
        "recogniser": {"restarts": 0, "busy_s": 0.0},
        "counts": {"frames": count},
    }
    text = metrics.render(status)
    figures = dict(row.rsplit(" ", 1) for row in text.splitlines() if not row.startswith("#"))
    assert float(figures["hapticvlm_underruns_total"]) == count
    assert float(figures['hapticvlm_events_total{kind="frames"}']) == count
