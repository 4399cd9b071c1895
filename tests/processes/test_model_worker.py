"""Tests that the answers of a child process are treated as untrusted data."""

import multiprocessing
from pathlib import Path

import pytest

from hapticvlm.processes.model_worker import WorkerPlan, _read

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
