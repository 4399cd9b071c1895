"""A private PulseAudio server whose one sink plays into nothing, and a recording of that sink.

Sound is heard where another program receives it: `parec` records the sink's monitor, and the time
at which a chunk arrives there is the time that counts. That includes the delay of the sound server,
and nothing is taken off for the place of a sample within its chunk.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
import threading
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hapticvlm.errors import HapticVLMError
from hapticvlm.rendering.vibration.vibration import RATE_HZ

NAME = "Palm"
NEEDED = ("pulseaudio", "pactl", "parec")
START_S = 20.0  # until a sound server answers

_CHUNK_BYTES = 1 << 16
_QUAD = "front-left,front-right,rear-left,rear-right"  # as of a DualSense


class SinkError(HapticVLMError):
    """Raised when a sound server cannot run here; the text says why."""


@dataclass(slots=True)
class Server:
    """One private PulseAudio daemon, which can be killed and started again."""

    folder: Path
    process: subprocess.Popen[bytes] | None = None
    channels: int = 1
    name: str = NAME
    channel_map: str | None = None

    @property
    def _sink(self) -> str:
        """The null sink, as a module's arguments."""
        shape = f"rate={RATE_HZ} channels={self.channels} format=float32le"
        channel_map = self.channel_map or (_QUAD if self.channels == 4 else None)
        if channel_map:
            shape += f" channel_map={channel_map}"
        return f"sink_name=palm {shape} sink_properties=device.description={self.name}"

    @property
    def environment(self) -> dict[str, str]:
        """Variables that lead a program to this server instead of the user's."""
        folder = str(self.folder)
        places = dict.fromkeys(("XDG_RUNTIME_DIR", "PULSE_RUNTIME_PATH", "XDG_CONFIG_HOME"), folder)
        return {**places, "PULSE_SERVER": f"unix:{folder}/native"}

    def start(self) -> None:
        """Start the daemon with its sink, and wait until it answers. Raises SinkError."""
        socket = f"module-native-protocol-unix socket={self.folder}/native auth-anonymous=1"
        self.process = subprocess.Popen(
            [
                *("pulseaudio", "-n", "--daemonize=no", "--use-pid-file=no"),
                *("--exit-idle-time=-1", "--realtime=yes", "--log-level=error"),
                *("-L", socket, "-L", f"module-null-sink {self._sink}"),
            ],
            env={**os.environ, **self.environment},
            stderr=subprocess.DEVNULL,
        )
        gives_up_at = time.monotonic() + START_S
        while self._control("info").returncode:
            if self.process.poll() is not None or time.monotonic() > gives_up_at:
                self.kill()
                raise SinkError(f"pulseaudio did not start within {START_S:g} s")
            time.sleep(0.05)

    def kill(self) -> None:
        """End the daemon as a crash would: its clients are not notified."""
        if self.process is not None:
            self.process.kill()
            self.process.wait()

    def unplug(self) -> None:
        """Remove the sink; the daemon goes on."""
        self._control("unload-module", "module-null-sink")

    def plug_in(self) -> None:
        """Add the sink again."""
        self._control("load-module", "module-null-sink", *self._sink.split())

    def _control(self, *words: str) -> subprocess.CompletedProcess[bytes]:
        command = ["pactl", *words]
        return subprocess.run(
            command, env={**os.environ, **self.environment}, capture_output=True, check=False
        )


@contextmanager
def null_sink(
    channels: int = 1, name: str = NAME, channel_map: str | None = None
) -> Iterator[Server]:
    """Run a server with one sink of this name (one word) and these channels.

    Environment variables lead this process, and those it starts, to that server for as long as the
    context lasts. Raises SinkError.
    """
    missing = [name for name in NEEDED if shutil.which(name) is None]
    if missing:
        raise SinkError(f"{', '.join(missing)} missing: install pulseaudio and pulseaudio-utils")
    with tempfile.TemporaryDirectory(prefix="hapticvlm-sink-") as folder:
        server = Server(Path(folder), None, channels, name, channel_map)
        with environment(server.environment):
            try:
                server.start()
                yield server
            finally:
                server.kill()


@contextmanager
def environment(variables: Mapping[str, str]) -> Iterator[None]:
    """Set variables for this process and those it starts, and restore them."""
    before = {name: os.environ.get(name) for name in variables}
    os.environ.update(variables)
    try:
        yield
    finally:
        for name, value in before.items():
            os.environ.pop(name, None)
            if value is not None:
                os.environ[name] = value


@dataclass(slots=True)
class Recording:
    """The recording so far: samples, and when each chunk of them arrived (monotonic clock, s)."""

    process: subprocess.Popen[bytes]
    chunks: list[tuple[float, bytes]] = field(default_factory=list)
    reader: threading.Thread | None = None

    def samples(self) -> NDArray[np.float32]:
        """Return all samples recorded, (n,) float32."""
        return np.frombuffer(b"".join(data for _, data in self.chunks), np.float32)

    def onset_after(self, moment: float, within_s: float) -> float | None:
        """Return when the first chunk with a sample that is not 0 arrived after `moment`, if any.

        That it arrived in a chunk counts as delay too: nothing is taken off for its place there.
        """
        for arrived, data in list(self.chunks):
            if moment < arrived <= moment + within_s and np.frombuffer(data, np.float32).any():
                return arrived
        return None

    def is_silent_since(self, moment: float) -> bool:
        """Return whether everything that arrived after `moment` is exactly 0."""
        return self.onset_after(moment, float("inf")) is None


@contextmanager
def recording(channels: int = 1) -> Iterator[Recording]:
    """Record the sink's monitor as fast as the server hands it out, interleaved."""
    command = ["parec", "--device=palm.monitor", "--raw", "--format=float32le", "--latency-msec=1"]
    process = subprocess.Popen(
        [*command, f"--rate={RATE_HZ}", f"--channels={channels}", "--no-remix", "--no-remap"],
        stdout=subprocess.PIPE,
        bufsize=0,
    )
    recorded = Recording(process)
    reader = threading.Thread(target=_record, args=(recorded,), name="recorder", daemon=True)
    reader.start()
    recorded.reader = reader
    try:
        yield recorded
    finally:
        process.kill()
        process.wait()
        reader.join(5.0)


def _record(recording: Recording) -> None:
    assert recording.process.stdout is not None
    # A read may end within a sample of four bytes: its beginning waits for the next read.
    rest = b""
    with suppress(ValueError), recording.process.stdout as pipe:
        while data := os.read(pipe.fileno(), _CHUNK_BYTES):
            data = rest + data
            whole = len(data) // 4 * 4
            rest = data[whole:]
            recording.chunks.append((time.monotonic(), data[:whole]))
