"""What each turn of the gateway's loop takes, timed inside a running service."""

import json

import pytest

from hapticvlm_lab.bench.latency import turns
from hapticvlm_lab.bench.latency.touch import RATE_HZ

pytestmark = pytest.mark.process
SECONDS = 2.0


@pytest.mark.nightly
def test_reads_frames_and_ticks_of_a_running_service_are_timed_and_listed_longest_first(capsys):
    assert turns.run(seconds=SECONDS, as_json=True) == 0
    figures = json.loads(capsys.readouterr().out)
    rows, floor = figures["rows"], figures["floor"]
    assert [row["p99_us"] for row in rows] == sorted((row["p99_us"] for row in rows), reverse=True)
    found = {row["what"]: row for row in rows}
    # Each of the 100 touches a second is read, and a picture is put off into a turn of its own.
    assert found["ClientSocket reads"]["n"] >= 0.9 * RATE_HZ * SECONDS
    assert {"Supervision.run", "ClientSocket._take_deferred_turn"} <= found.keys()
    assert floor["n"] >= 0.9 * RATE_HZ * SECONDS
    for row in (*rows, floor):
        assert 0.0 < row["median_us"] <= row["p99_us"] <= row["longest_us"]
        assert row["n"] >= (1.0 - turns.WARM_UP) * turns.LEAST_HZ * SECONDS - 1


def test_an_echo_costs_its_read_and_all_that_follows_until_the_next():
    begins = [("Server.start", 50.0), ("call_soon", 3.0)]
    first = [("ServerConnection reads", 10.0), ("Server.conn_handler", 5.0), ("timer", 1.0)]
    second = [("ServerConnection reads", 20.0), ("Server.conn_handler", 7.0)]
    assert turns.by_message([*begins, *first, *second]) == [16.0, 27.0]
