"""A JACK server of our own whose driver plays into nothing, on its own clock.

jackd's dummy driver: no sound card, no system service. A JACK client reaches it by the server's
name, so nothing of the user's sound set-up is read or changed. It needs no real-time permission to
run, but plays with gaps without it.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from hapticvlm.devices.speaker.engine import AudioSettings
from hapticvlm.devices.speaker.output import JACK
from hapticvlm.devices.speaker.speaker import Speaker
from hapticvlm.rendering.vibration.vibration import RATE_HZ
from hapticvlm_lab.bench.audio.clock import command
from hapticvlm_lab.bench.audio.sink import SinkError, environment

PRIORITY = 40  # above the engine's, as a sound server's is
START_S = 20.0
_LEASE_S = 0.5
_RENEWED_S = 0.1
_SETTLED_S = 0.5
_SOCKETS = (Path("/dev/shm"), Path("/tmp"))


@contextmanager
def dummy(block: int) -> Iterator[subprocess.Popen[bytes]]:
    """Run jackd, to which this process and those it starts are led meanwhile. Raises SinkError."""
    if shutil.which("jackd") is None:
        raise SinkError("jackd missing: install jackd2")
    name = f"hapticvlm-{os.getpid()}"
    ours = {"JACK_DEFAULT_SERVER": name, "JACK_NO_AUDIO_RESERVATION": "1"}
    ours["JACK_NO_START_SERVER"] = "1"
    daemon = ["jackd", "-n", name, "-R", "-P", str(PRIORITY), "-d", "dummy"]
    daemon += ["-r", str(RATE_HZ), "-p", str(block), "-C", "0", "-P", "2"]
    with environment(ours):
        server = subprocess.Popen(daemon, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            _await(server, name)
            yield server
        finally:
            server.terminate()
            server.wait()


def underruns(seconds: float, block: int, *, realtime: bool) -> dict[str, Any]:
    """Hold a slide on the dummy and count the periods that were missed. Raises SinkError."""
    with dummy(block):
        speaker = Speaker(AudioSettings(JACK, block, realtime=realtime))
        speaker.start()
        ends_at = time.monotonic() + seconds
        before = speaker.underruns
        try:
            while time.monotonic() < ends_at:
                speaker.play(command("slide", 1, _LEASE_S))
                time.sleep(_RENEWED_S)
            status = speaker.status()
            missed = speaker.underruns - before
        finally:
            speaker.close()
    counts = {"seconds": seconds, "block": block, "underruns": missed}
    return {**counts, "samples": status.samples, "realtime": status.realtime}


def _await(server: subprocess.Popen[bytes], name: str) -> None:
    """Wait until the server has opened the socket to which clients go."""
    gives_up_at = time.monotonic() + START_S
    while not any(list(folder.glob(f"jack_{name}_*")) for folder in _SOCKETS):
        if server.poll() is not None or time.monotonic() > gives_up_at:
            raise SinkError("jackd does not start here")
        time.sleep(0.05)
    time.sleep(_SETTLED_S)
