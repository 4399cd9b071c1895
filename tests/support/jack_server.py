"""A JACK server of our own whose driver plays into nothing, on its own clock."""

from __future__ import annotations

import os
import shutil
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from null_sink import START_S, SinkError, environment

from hapticvlm.devices.speaker.channels import JACK
from hapticvlm.devices.speaker.engine import AudioSettings
from hapticvlm.devices.speaker.speaker import Speaker
from hapticvlm.rendering.vibration.vibration import RATE_HZ, Motion
from hapticvlm.rendering.vibration.voices import Command

PRIORITY = 40  # above the engine's, as that of a sound server is
SLIDE_LEASE_S = 0.5
RENEWAL_S = 0.05
SOCKETS = (Path("/dev/shm"), Path("/tmp"))


def jack_underruns(seconds: float, block: int, *, realtime: bool) -> dict[str, Any]:
    """Hold a slide on the dummy and count the missed periods. Raises SinkError."""
    with jack_dummy(block):
        speaker = Speaker(AudioSettings(JACK, block, realtime=realtime))
        speaker.start()
        ends_at = time.monotonic() + seconds
        before = speaker.underruns
        try:
            while time.monotonic() < ends_at:
                speaker.play(_slide_over_wood())
                time.sleep(RENEWAL_S)
            status = speaker.status()
            missed = speaker.underruns - before
        finally:
            speaker.close()
    counts = {"seconds": seconds, "block": block, "underruns": missed}
    return {**counts, "samples": status.samples, "realtime": status.realtime}


def _slide_over_wood() -> Command:
    return Command(
        hand=1,
        material="wood",
        interaction="slide",
        onset=False,
        motion=Motion(0.5, 2.0),
        seed=1,
        expires_at=time.monotonic() + SLIDE_LEASE_S,
    )


@contextmanager
def jack_dummy(block: int) -> Iterator[subprocess.Popen[bytes]]:
    """Run jackd with its dummy driver, which needs no sound card. Raises SinkError.

    A client reaches it by the server's name, so nothing of the user's sound set-up is read or
    changed. It runs without real-time permission, but plays with gaps then.
    """
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
            _await_jack(server, name)
            yield server
        finally:
            server.terminate()
            server.wait()


def _await_jack(server: subprocess.Popen[bytes], name: str) -> None:
    """Wait until the server has opened the socket for its clients."""
    gives_up_at = time.monotonic() + START_S
    while not any(list(folder.glob(f"jack_{name}_*")) for folder in SOCKETS):
        if server.poll() is not None or time.monotonic() > gives_up_at:
            raise SinkError("jackd does not start here")
        time.sleep(0.05)
    time.sleep(0.5)
