"""What a touch stands: rows measured beside real busy programs, and where a row breaks."""

import json

import pytest

from hapticvlm_lab.bench.latency import stability

pytestmark = pytest.mark.process


def row(priority, busy, stream, p99_ms):
    return {"priority": priority, "busy": busy, "stream": stream, "touch_p99_ms": p99_ms}


@pytest.mark.nightly
def test_a_touch_is_measured_beside_an_echo_under_each_stream(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(stability, "PER_CORE", (1,))
    monkeypatch.setattr(stability, "SECONDS", 0.5)
    monkeypatch.setattr(stability, "is_priority_permitted", lambda: False)  # half as long
    assert stability.run(tmp_path, as_json=True) == 0
    told = json.loads(capsys.readouterr().out)
    assert {found["stream"] for found in told["rows"]} == set(stability.STREAMS_HZ)
    for found in told["rows"]:
        assert found["n"] == 50
        assert found["busy"] == told["cpus"]
        assert 0.0 < found["touch_median_ms"] <= found["touch_p99_ms"]
    assert (tmp_path / "stability-latency.png").stat().st_size > 10_000


def test_it_breaks_where_one_touch_of_a_hundred_first_comes_too_late():
    rows = [row("normal", busy, "no frames", p99) for busy, p99 in ((0, 1.0), (2, 11.0), (4, 30.0))]
    rows += [row("real-time", busy, "no frames", 1.0) for busy in (0, 2, 4)]
    assert stability.breaks_at(rows, "normal", "no frames") == 2
    assert stability.breaks_at(rows, "real-time", "no frames") is None
