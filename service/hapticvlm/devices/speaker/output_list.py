"""Lists the audio outputs of this machine, from a process of its own.

A sound system can hang for ever, and ALSA writes to the terminal. In a separate process the first
ends at a timeout, and the second goes into a pipe.
"""

from __future__ import annotations

import json
import subprocess
import sys
from typing import Any

AUDIO_S = 3.5
_PROGRAM = (
    "import json; from hapticvlm.devices.speaker.output import playbacks; "
    "print(json.dumps([{key: output[key] for key in ('name', 'system_name')} | {'formats': "
    "[{'channels': form['channels']} for form in output['formats']]} for output in playbacks()]))"
)


def has_output() -> bool:
    """Return whether this machine lists an audio output within AUDIO_S."""
    try:
        return bool(outputs())
    except subprocess.TimeoutExpired:
        return False


def outputs() -> list[dict[str, Any]]:
    """Return this machine's outputs, each with its names and the channels of its `formats`.

    Raises TimeoutExpired after AUDIO_S.
    """
    result = subprocess.run(
        [sys.executable, "-c", _PROGRAM],
        capture_output=True,
        text=True,
        timeout=AUDIO_S,
        check=False,
    )
    found: list[dict[str, Any]] = json.loads(result.stdout) if result.returncode == 0 else []
    return found
