"""Runs the connection tests at the length of the README's figures: 10 kills, 3000 frames at 30/s.

Run as `python tests/unity_client/long_run.py`; the shorter run is part of the test suite.
"""

import os
import subprocess
import sys
from pathlib import Path

LONG = {"HAPTICVLM_KILLS": "10", "HAPTICVLM_FRAMES": "3000", "HAPTICVLM_RATE": "30"}

if __name__ == "__main__":
    tests = Path(__file__).with_name("test_service.py")
    command = [sys.executable, "-m", "pytest", "-q", str(tests)]
    sys.exit(subprocess.call(command, env={**os.environ, **LONG}))
