"""Tests the supervision of a child process: restarts, pauses, and that it never blocks."""

import errno
import multiprocessing
import os
import signal
import time
from functools import partial
from pathlib import Path

import pytest
from pace import PACE, until

import hapticvlm
from hapticvlm.processes.supervised import Child, ChildError, Started

FILES = Path("/proc/self/fd")


def obedient(control):
    """Say ready, then wait to be ended."""
    Started((str(os.getpid()),)).send(control)
    with_nothing_to_say(control)


def torn(control):
    """Die in the middle of the first message."""
    os.write(control.fileno(), b"\0\0\1\0half")
    os._exit(3)


def given_much(data, control):
    """Say ready once all of what was given has arrived."""
    Started((str(len(data)),)).send(control)
    with_nothing_to_say(control)


def starved(control):
    Started().send(control)
    raise MemoryError


def broken(control):
    Started().send(control)
    raise RuntimeError("a defect")


def interrupted(control):
    """Say ready although Ctrl-C came before this function could have ignored it."""
    os.kill(os.getpid(), signal.SIGINT)
    obedient(control)


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


@pytest.mark.skipif(os.name == "nt", reason="a signal cannot be blocked there")
def test_ctrl_c_of_the_terminal_does_not_end_a_child_that_is_still_importing(watched):
    child = watched(interrupted)
    child.start()
    assert child.ready_at is not None


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


def test_a_closed_child_may_end_by_itself_and_never_outlives_this_process(watched):
    child = watched(obedient)
    child.start()
    (process,) = (each for each in multiprocessing.active_children() if each.pid == child.pid)
    assert process.daemon
    child.close(10.0 * PACE)
    assert process.exitcode == 0


@pytest.mark.parametrize("target", [starved, broken])
def test_only_a_child_that_runs_out_of_memory_ends_without_a_traceback(watched, target, capfd):
    child = watched(target)
    child.start()
    said = until(lambda: child.supervise(time.monotonic(), is_well=True))
    assert said == "the child died (exit code 1); restarted at once"
    told = capfd.readouterr().err
    assert ("the child ended: no memory" in told, "Traceback" in told) == (
        (True, False) if target is starved else (False, True)
    )


def test_a_child_that_dies_in_the_middle_of_its_first_message_is_said_to_have_died(watched):
    child = watched(torn)
    child.begin()
    assert "died" in until(lambda: child.supervise(time.monotonic(), is_well=True))


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


MUCH = 20 * 1024 * 1024  # more than any pipe holds


@pytest.mark.realtime
def test_starting_a_child_that_is_given_more_than_a_pipe_holds_waits_for_nobody():
    names: list[tuple[str, ...]] = []
    child = Child("child", given_much, lambda: (bytes(MUCH),), names.append)
    try:
        begun = time.monotonic()
        child.begin()
        longest = time.monotonic() - begun
        while not child.ready_at:
            started = time.monotonic()
            assert child.supervise(started, is_well=True) is None
            longest = max(longest, time.monotonic() - started)
            time.sleep(0.005)
        whole = time.monotonic() - begun
    finally:
        child.close(0.0)
    assert names == [(str(MUCH),)]
    # A write that waits for the child lasts until it has started Python and its imports, which is
    # nearly all of the time, however busy the machine is.
    assert longest < 0.5 * whole


def test_a_system_without_room_for_a_child_is_one_more_failure_with_a_growing_pause():
    def no_room():
        raise OSError(errno.EMFILE, "Too many open files")

    child = Child("child", obedient, no_room, lambda _: None)
    said = []
    child.begin()
    now = time.monotonic()
    for _ in range(3):
        said.append(until(partial(child.supervise, now, is_well=True)))
        now += 60.0
    child.close(0.0)
    assert said[0] == "the child could not be started: Too many open files; restarted at once"
    assert [line.rsplit("restarted ", 1)[1] for line in said] == ["at once", "in 1 s", "in 2 s"]


def test_a_child_for_which_there_is_no_room_at_the_start_is_a_clear_error():
    def no_room():
        raise OSError(errno.ENOMEM, "Cannot allocate memory")

    child = Child("child", obedient, no_room, lambda _: None)
    with pytest.raises(ChildError, match="could not be started: Cannot allocate memory"):
        child.start()


@pytest.fixture
def updated(tmp_path, monkeypatch):
    """Put another version of this program before it, as an update does to a running service."""
    for entry in Path(hapticvlm.__file__).parent.iterdir():
        if entry.name != "__init__.py":
            (tmp_path / "hapticvlm").mkdir(exist_ok=True)
            (tmp_path / "hapticvlm" / entry.name).symlink_to(entry)
    (tmp_path / "hapticvlm" / "__init__.py").write_text('__version__ = "99.1"\n')
    monkeypatch.syspath_prepend(tmp_path)


@pytest.mark.usefixtures("updated")
def test_a_child_of_another_version_is_refused_with_what_to_do(watched):
    with pytest.raises(ChildError, match=r"99\.1.*restart the service") as refusal:
        watched(obedient).start()
    assert hapticvlm.__version__ in str(refusal.value)


def test_a_child_that_dies_after_an_update_is_not_restarted_in_another_version(watched, request):
    child = watched(obedient)
    child.start()
    request.getfixturevalue("updated")
    os.kill(child.pid, signal.SIGKILL)
    reports = []

    def is_refused():
        reports.append(child.supervise(time.monotonic(), is_well=True))
        return any("99.1" in report for report in reports if report)

    until(is_refused)
    assert "restart the service" in reports[-1]


class Unloadable:
    """An argument that cannot be unpickled where memory is scarce."""

    def __reduce__(self):
        return _map_library, ()


def _map_library():
    raise ImportError("libmodel.so: failed to map segment from shared object")


def test_a_child_for_whose_libraries_no_memory_is_left_says_so_in_a_sentence():
    child = Child("child", given_much, lambda: (Unloadable(),), lambda _: None)
    with pytest.raises(ChildError, match="the child cannot be loaded: no memory"):
        child.start()
