"""SIGTERM: a demo takes the service it started with it, and a service may still be starting."""

import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from pace import PACE, until

WAITING = """
import time
from hapticvlm.client.local_service import ending_on_sigterm
with ending_on_sigterm():
    try:
        print("waiting", flush=True)
        time.sleep(60)
    finally:
        print("stopped the service", flush=True)
"""


def catches(status, number):
    """Whether a process of this /proc/PID/status has a handler for a signal."""
    (caught,) = re.findall(r"^SigCgt:\s*(\w+)", status, re.MULTILINE)
    return int(caught, 16) >> (number - 1) & 1


@pytest.mark.skipif(os.name == "nt", reason="Windows ends a process without asking it")
def test_sigterm_unwinds_what_a_demo_has_started():
    process = subprocess.Popen([sys.executable, "-c", WAITING], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert process.stdout.readline() == "waiting\n"
    process.send_signal(signal.SIGTERM)
    said, _ = process.communicate(timeout=60 * PACE)
    assert said == "stopped the service\n"
    assert process.returncode == 143


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="only Linux lists the signals")
def test_sigterm_to_a_whole_group_ends_a_service_that_is_starting_without_an_error():
    words = [sys.executable, "-m", "hapticvlm", "serve", "--port", "0"]
    service = subprocess.Popen(words, stdout=-1, stderr=-1, text=True, start_new_session=True)
    status = Path(f"/proc/{service.pid}/status")
    until(lambda: catches(status.read_text(), signal.SIGTERM))  # while its children load
    os.killpg(service.pid, signal.SIGTERM)
    said, complaints = service.communicate(timeout=60 * PACE)
    assert (service.returncode, complaints) == (0, "")
    assert "outputs at rest" in said
