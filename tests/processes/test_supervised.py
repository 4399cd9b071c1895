"""A child process under watch: what becomes of it, and that watching never waits."""

import multiprocessing
import os
import signal
import time
from pathlib import Path

import pytest

from hapticvlm.processes.supervised import Child, Started

PATIENCE_S = 60.0
FILES = Path("/proc/self/fd")


def obedient(control):
    """Say ready, then wait to be ended."""
    Started((str(os.getpid()),)).send(control)
    with_nothing_to_say(control)


def torn(control):
    """Die in the middle of the first message."""
    os.write(control.fileno(), b"\0\0\1\0half")
    os._exit(3)


def with_nothing_to_say(control):
    try:
        control.recv()
    except EOFError:
        return


@pytest.fixture
def watched():
    children = []

    def make(target):
        child = Child("child", target, lambda: (), lambda _: None)
        children.append(child)
        return child

    yield make
    for child in children:
        child.close(0.0)


def until(claim):
    started = time.monotonic()
    while not claim():
        assert time.monotonic() - started < PATIENCE_S
        time.sleep(0.01)


def test_a_child_that_hangs_is_replaced_by_another_once_it_is_gone(watched):
    child = watched(obedient)
    child.start()
    first = child.pid
    said = child.supervise(time.monotonic(), is_well=False)
    assert said == "the child hung; restarted at once"
    assert child.pid is None  # the watch went on; it waits for no process to die
    until(lambda: child.supervise(time.monotonic(), is_well=True) is None and child.ready_at)
    assert child.pid != first
    assert first not in [process.pid for process in multiprocessing.active_children()]


def test_a_child_that_dies_in_the_middle_of_its_first_message_is_said_to_have_died(watched):
    child = watched(torn)
    child.begin()
    said = []

    def has_died():
        said.append(child.supervise(time.monotonic(), is_well=True))
        return said[-1] is not None

    until(has_died)
    assert "died" in said[-1]


@pytest.mark.skipif(not FILES.is_dir(), reason="only Linux lists its open files")
def test_restarts_leave_no_files_open(watched):
    child = watched(obedient)
    child.start()
    opened = []
    for _ in range(4):
        os.kill(child.pid, signal.SIGKILL)
        until(lambda: child.supervise(time.monotonic(), is_well=True) is not None)
        child._retry_at = time.monotonic()  # spare the growing pauses
        until(lambda: child.supervise(time.monotonic(), is_well=True) is None and child.ready_at)
        opened.append(sum(1 for _ in FILES.iterdir()))
    assert opened[-1] == opened[0]
