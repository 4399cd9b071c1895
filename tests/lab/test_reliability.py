"""The rig of stop and the hostile clients: what they make of what they measured."""

import subprocess
from pathlib import Path

import numpy as np
import pytest
from null_sink import Recording

from hapticvlm.client.local_service import Service
from hapticvlm.server.edge.limits import MAX_SCENES
from hapticvlm_lab.bench.reliability.board import PtyBoard, board_on_a_terminal
from hapticvlm_lab.bench.reliability.stop import Outputs, Trial, _holds, _row
from hapticvlm_lab.bench.reliability.stop import summary as stopped
from hapticvlm_lab.bench.reliability.stop_conditions import LOAD, Condition

with subprocess.Popen(["true"]) as NOTHING:
    pass


def test_the_load_is_one_that_the_service_lets_in():
    assert int(LOAD[2]) + 1 <= MAX_SCENES  # beside an owner


def heard(*sounding_at):
    chunks = []
    for number in range(100):
        loud = any(abs(number / 100 - at) < 1e-9 for at in sounding_at)
        chunks.append((number / 100, np.full(480, 0.1 if loud else 0.0, np.float32).tobytes()))
    return Recording(NOTHING, chunks)


def test_silence_begins_with_the_last_sound_after_a_stop():
    board = PtyBoard("")
    outputs = Outputs(heard(0.48, 0.51, 0.52), board)
    assert outputs.silent_after(0.5, 0.9) == pytest.approx(0.02)
    assert Outputs(heard(0.48), board).silent_after(0.5, 0.9) == 0.0
    still_on = Outputs(heard(*(number / 100 for number in range(100))), board)
    assert still_on.silent_after(0.5, 0.9) == float("inf")


def test_one_stop_that_never_came_is_the_p99():
    trials = [Trial(1.0, 10.0, 20.0, 20.0)] * 30 + [Trial(1.0, 10.0, 20.0, float("inf"))]
    found = stopped(trials)
    assert found["silent"] == {"median": 10.0, "p99": 10.0, "max": 10.0}
    assert found["bridge"]["p99"] == float("inf")


def test_a_condition_that_fails_is_reported_and_holds_nothing():
    def load(_):
        raise OSError("no browser")

    condition = Condition(load=load)
    nowhere = Service(subprocess.Popen(["true"], text=True), "", 0.0)
    nowhere.process.wait()
    row = _row(condition, Outputs(heard(), PtyBoard("")), nowhere)
    assert row["failed"] == "OSError: no browser"
    assert not _holds(row)
    assert _holds(stopped([Trial(1.0, 10.0, 20.0, 20.0)] * 3))
    assert not _holds(stopped([Trial(1.0, 10.0, 20.0, 60.0)] * 3))


def test_a_board_on_a_terminal_is_there_until_the_context_ends():
    with board_on_a_terminal() as board:
        assert Path(board.port).exists()
        assert board.state == "OFF"
    assert not Path(board.port).exists()
