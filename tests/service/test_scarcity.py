"""With few descriptors or little memory the service runs, or says in one line why it does not."""

import asyncio
import signal
import subprocess
import sys

import pytest
from pace import PACE
from plain_words import is_plain
from ports import free_port

from hapticvlm.commands.run_service import report_error

pytestmark = [
    pytest.mark.nightly,
    pytest.mark.skipif(sys.platform != "linux", reason="only Linux keeps to these limits"),
]
LIMITED = """
import resource, sys
resource.setrlimit(resource.{}, ({limit}, {limit}))
from hapticvlm.__main__ import run

sys.exit(run())
"""
MB = 1024**2


def started(kind, limit):
    """Return what the service printed until it was ready or had ended, and its exit code."""
    program = LIMITED.format(kind, limit=limit)
    command = [sys.executable, "-c", program, "serve", "--port", str(free_port())]
    service = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert service.stdout is not None
    first = service.stdout.readline()
    if first:
        service.send_signal(signal.SIGTERM)
    _, errors = service.communicate(timeout=60 * PACE)
    return first, errors, service.returncode


def test_64_descriptors_are_enough():
    first, _, code = started("RLIMIT_NOFILE", 64)
    assert "ready" in first
    assert code == 0


@pytest.mark.parametrize("limit", [16, 20, 24])
def test_few_descriptors_are_enough_or_said_in_one_line(limit):
    # How many are needed at once differs from run to run, by what the parts open as they start.
    first, errors, code = started("RLIMIT_NOFILE", limit)
    assert code == 0 if first else (code == 2 and "Too many open files" in errors)
    assert "Traceback" not in errors


@pytest.mark.parametrize("megabytes", [100, 250, 350, 767])
def test_less_memory_than_the_service_needs_is_said_before_anything_starts(megabytes):
    first, errors, code = started("RLIMIT_AS", megabytes * MB)
    assert (first, code) == ("", 2)
    assert f"allows {megabytes} MB of memory (ulimit -v) and the service needs 768" in errors
    assert "Traceback" not in errors
    assert is_plain(errors)


@pytest.mark.parametrize("megabytes", [768, 1024])
def test_the_memory_that_the_service_asks_for_is_enough(megabytes):
    first, errors, code = started("RLIMIT_AS", megabytes * MB)
    assert "ready" in first
    assert code == 0
    assert "memory" not in errors


async def test_memory_that_is_used_up_in_a_callback_is_one_sentence(caplog):
    loop = asyncio.get_running_loop()
    loop.set_exception_handler(report_error)
    failed = loop.create_future()
    failed.set_exception(MemoryError())
    failed.add_done_callback(asyncio.Future.result)
    await asyncio.sleep(0)
    assert "no memory or no thread is left" in caplog.text
    assert "Traceback" not in caplog.text
