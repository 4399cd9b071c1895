"""Lists the audio outputs of this machine, from a process of its own.

A sound system can hang for ever, and ALSA writes to the terminal. In a separate process the first
ends at a timeout, and the second goes into a pipe.
"""

from __future__ import annotations

import json
import subprocess
import sys

AUDIO_S = 3.5
_PROGRAM = (
    "import json; from hapticvlm.devices.speaker.output import playbacks; "
    "print(json.dumps([output['name'] for output in playbacks()]))"
)


def has_output() -> bool:
    """Return whether this machine lists an audio output within AUDIO_S."""
    try:
        return bool(output_names())
    except subprocess.TimeoutExpired:
        return False


def output_names() -> list[str]:
    """Return the names of this machine's outputs. Raises TimeoutExpired after AUDIO_S."""
    result = subprocess.run(
        [sys.executable, "-c", _PROGRAM],
        capture_output=True,
        text=True,
        timeout=AUDIO_S,
        check=False,
    )
    names: list[str] = json.loads(result.stdout) if result.returncode == 0 else []
    return names
