"""A record begins with the first message, or when a scene stays without one."""

from hapticvlm.recordings.lines import Input, Key, Line
from hapticvlm.recordings.recorder import LateRecord

MAX_HELD = 500

TICK: Line = {Key.IN: Input.TICK, Key.NOW: 1.0}
MESSAGE: Line = {Key.IN: Input.MESSAGE, Key.NOW: 2.0}


class Begun:
    """Counts how often a record was begun, and keeps its lines."""

    def __init__(self):
        self.lines = []
        self.times = 0

    def begin(self):
        self.times += 1
        return lambda line, frame: self.lines.append((line, frame))


def test_nothing_is_begun_for_one_that_only_says_hello():
    begun = Begun()
    record = LateRecord(begun.begin)
    for _ in range(MAX_HELD - 1):
        record(TICK, None)
    assert (begun.times, begun.lines) == (0, [])


def test_the_first_message_begins_it_and_no_line_before_is_lost():
    begun = Begun()
    record = LateRecord(begun.begin)
    for line in (TICK, MESSAGE, TICK):
        record(line, None)
    assert (begun.times, begun.lines) == (1, [(TICK, None), (MESSAGE, None), (TICK, None)])


def test_a_scene_that_stays_silent_is_recorded_too():
    begun = Begun()
    record = LateRecord(begun.begin)
    for _ in range(MAX_HELD + 3):
        record(TICK, None)
    assert (begun.times, len(begun.lines)) == (1, MAX_HELD + 3)
