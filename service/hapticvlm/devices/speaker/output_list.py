"""Which audio outputs this machine lists, asked in a process of its own.

A sound system can hang for ever, and ALSA writes to the terminal: neither may reach the caller.
"""

from __future__ import annotations

import json
import subprocess
import sys

AUDIO_S = 3.5
# In a process of its own: a sound system can hang for ever, and ALSA writes to the terminal.
_LIST = (
    "import json; from hapticvlm.devices.speaker.output import playbacks; "
    "print(json.dumps([found['name'] for found in playbacks()]))"
)


def has_output() -> bool:
    """Return whether this machine lists an audio output within AUDIO_S."""
    try:
        return bool(output_names())
    except subprocess.TimeoutExpired:
        return False


def output_names() -> list[str]:
    """Return the names of this machine's outputs. Raises TimeoutExpired."""
    done = subprocess.run(
        [sys.executable, "-c", _LIST],
        capture_output=True,
        text=True,
        timeout=AUDIO_S,
        check=False,
    )
    found: list[str] = json.loads(done.stdout) if done.returncode == 0 else []
    return found
