"""With few descriptors or little memory the service runs, or says in one line why it does not."""

import signal
import subprocess
import sys

import pytest
from pace import PACE
from plain_words import is_plain
from ports import free_port

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


@pytest.mark.parametrize("limit", [16, 20])
def test_too_few_descriptors_are_said_in_one_line(limit):
    first, errors, code = started("RLIMIT_NOFILE", limit)
    assert first == ""
    assert code == 2
    assert "Too many open files" in errors
    assert "Traceback" not in errors


@pytest.mark.parametrize("megabytes", [250, 300, 350, 400, 500])
def test_little_memory_is_enough_or_said_without_a_traceback(megabytes):
    first, errors, code = started("RLIMIT_AS", megabytes * MB)
    assert code == 0 if first else "memory" in errors
    assert "Traceback" not in errors
    assert is_plain(errors)
