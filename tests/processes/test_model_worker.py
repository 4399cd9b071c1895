"""Tests the hand-over to a model's process, whose answers are treated as untrusted data."""

import multiprocessing
import os
import struct
from multiprocessing.connection import Connection
from pathlib import Path

import pytest
from pace import until

from hapticvlm.processes.model_worker import (
    ModelWorker,
    Slot,
    WorkerPlan,
    WorkerReply,
    _encode,
    _read,
    serve_requests,
)
from hapticvlm.processes.supervised import Started

PLAN = WorkerPlan("test", print, None, dict, 1.0)


class Hostile:
    """Its pickle creates a folder when it is loaded."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def __reduce__(self):
        return Path.mkdir, (self.folder,)


def test_a_pickle_from_a_child_runs_nothing_and_ends_the_reading(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    folder = tmp_path / "made by a pickle"
    ours, theirs = multiprocessing.Pipe()
    answers: list[object] = []
    theirs.send(Hostile(folder))
    _read(ours, answers.append, PLAN)
    assert answers == []
    assert not folder.exists()
    assert "an answer that cannot be decoded" in caplog.text

    theirs.send(Hostile(folder))
    ours.recv()
    assert folder.exists(), "loaded as a pickle it does run"


def echo(slot: Slot, settings: str, control: Connection) -> None:
    """Answer each request with its picture and details."""
    started = Started(("echo", settings))
    serve_requests(slot, control, lambda: (started, lambda data, details: [data, *details]))


def test_a_request_keeps_the_worker_busy_until_its_own_answer() -> None:
    replies: list[WorkerReply[list[object]]] = []
    worker: ModelWorker[list[object]] = ModelWorker(WorkerPlan("test", echo, "loud", list, 1.0))
    try:
        worker.start(replies.append)
        assert worker.names == ("echo", "loud")
        for number, data in enumerate((b"longer", b"short"), start=1):
            worker.request(data, ("a", 2), now=5.0)
            assert worker.is_busy
            until(lambda: len(replies) == number)  # noqa: B023
            assert replies[-1] == WorkerReply(number, [data, "a", 2])
            assert worker.accept(replies[-1], now=5.5)
            assert not worker.accept(replies[-1], now=6.0)
            assert not worker.is_busy
        assert worker.busy_s == 1.0
    finally:
        worker.close()


def test_an_answer_has_at_most_8_mib_and_no_objects() -> None:
    for size, is_read in ((8 * 2**20, True), (8 * 2**20 + 1, False)):
        ours, theirs = multiprocessing.Pipe()
        os.write(theirs.fileno(), struct.pack("!i", size))
        theirs.close()
        _read(ours, print, PLAN)
        assert ours.readable == is_read
    with pytest.raises(TypeError, match="an answer must not contain a PosixPath"):
        _encode([Path()])
