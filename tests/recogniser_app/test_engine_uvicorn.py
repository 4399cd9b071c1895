"""The shared recogniser in one process, from its start on."""

import signal
import subprocess
import sys

import pytest
from pace import PACE

ENDS_S = 10.0 * PACE
LOADS_LONG = """
import sys
import time

import onnxruntime


def load(*_, **__):
    print("loading", flush=True)
    time.sleep(3600)


onnxruntime.InferenceSession.__init__ = load
from hapticvlm.commands.main import main

sys.exit(main(["recogniser-app", "--port", "0"]))
"""


@pytest.mark.process
@pytest.mark.needs_toolchain("uvicorn")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_recogniser_that_still_loads_its_network_can_be_stopped(number):
    process = subprocess.Popen([sys.executable, "-c", LOADS_LONG], stdout=subprocess.PIPE)
    assert process.stdout is not None
    with process.stdout:
        try:
            assert process.stdout.readline() == b"loading\n"
            process.send_signal(number)
            assert process.wait(ENDS_S) in (130, -number)
        finally:
            process.kill()
            process.wait()
