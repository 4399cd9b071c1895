"""A demo that is ended by SIGTERM takes the service it started with it."""

import os
import signal
import subprocess
import sys

import pytest
from pace import PACE

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


@pytest.mark.skipif(os.name == "nt", reason="Windows ends a process without asking it")
def test_sigterm_unwinds_what_a_demo_has_started():
    process = subprocess.Popen([sys.executable, "-c", WAITING], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert process.stdout.readline() == "waiting\n"
    process.send_signal(signal.SIGTERM)
    said, _ = process.communicate(timeout=60 * PACE)
    assert said == "stopped the service\n"
    assert process.returncode == 143
