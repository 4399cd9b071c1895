"""A private PulseAudio or PipeWire whose one sink plays into nothing, and a recording of that sink.

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
from pace import until

from hapticvlm.errors import HapticVLMError
from hapticvlm.rendering.vibration.vibration import RATE_HZ

NAME = "Palm"
PULSEAUDIO, PIPEWIRE = KINDS = ("pulseaudio", "pipewire")
NEEDED = ("pulseaudio", "pactl", "parec")
START_S = 60.0  # until a sound server answers

_CHUNK_BYTES = 1 << 16
QUAD = "front-left,front-right,rear-left,rear-right"  # as of a DualSense


class SinkError(HapticVLMError):
    """Raised when a sound server cannot run here; the text says why."""


@dataclass(slots=True)
class Server:
    """One private sound server, which can be killed and started again."""

    folder: Path
    kind: str = PULSEAUDIO
    processes: list[subprocess.Popen[bytes]] = field(default_factory=list)
    channels: int = 1
    name: str = NAME
    channel_map: str | None = None

    @property
    def _sink(self) -> str:
        """The null sink, as a module's arguments."""
        shape = f"rate={RATE_HZ} channels={self.channels} format=float32le"
        if self.channel_map:
            shape += f" channel_map={self.channel_map}"
        return f"sink_name=palm {shape} sink_properties=device.description={self.name}"

    @property
    def environment(self) -> dict[str, str]:
        """Variables that lead a program to this server instead of the user's."""
        folder = str(self.folder)
        names = ("XDG_RUNTIME_DIR", "PULSE_RUNTIME_PATH", "XDG_CONFIG_HOME", "XDG_STATE_HOME")
        return {**dict.fromkeys(names, folder), "PULSE_SERVER": f"unix:{folder}/native"}

    def start(self) -> None:
        """Start the server with its sink, and wait until it is the default. Raises SinkError."""
        if self.kind == PIPEWIRE:
            self._run("pipewire")
            self._wait_for("pw-cli", "info", "0")
            self._run("pipewire-pulse")
            self._run("dbus-run-session", "--", "wireplumber")  # which ends without a bus
        else:
            socket = f"module-native-protocol-unix socket={self.folder}/native auth-anonymous=1"
            arguments = ("--daemonize=no", "--use-pid-file=no", "-L", socket)
            options = ("--exit-idle-time=-1", "--realtime=yes", "--log-level=error")
            self._run("pulseaudio", "-n", *arguments, *options)
        self._wait_for("pactl", "info")
        self.plug_in()
        self._wait_for("pactl", "info", words=b"Default Sink: palm")

    def kill(self) -> None:
        """End the server as a crash would: its clients are not notified."""
        for process in self.processes[:2]:
            process.kill()
        for process in self.processes:  # the session manager ends with PipeWire, its bus with it
            with suppress(subprocess.TimeoutExpired):
                process.wait(START_S)
            process.kill()
        self.processes.clear()

    def unplug(self) -> None:
        """Remove the sink; the server goes on."""
        self._control("pactl", "unload-module", "module-null-sink")

    def plug_in(self) -> None:
        """Add the sink again."""
        self._control("pactl", "load-module", "module-null-sink", *self._sink.split())

    def _run(self, *command: str) -> None:
        """Start a program of the server."""
        null = subprocess.DEVNULL
        self.processes.append(subprocess.Popen(command, stdout=null, stderr=null))

    def _wait_for(self, *command: str, words: bytes = b"") -> None:
        """Wait until a program succeeds and prints these words. Raises SinkError."""
        gives_up_at = time.monotonic() + START_S
        while (done := self._control(*command)).returncode or words not in done.stdout:
            if self.processes[0].poll() is not None or time.monotonic() > gives_up_at:
                self.kill()
                raise SinkError(f"{self.kind} did not start within {START_S:g} s")
            time.sleep(0.05)

    def _control(self, *command: str) -> subprocess.CompletedProcess[bytes]:
        return subprocess.run(command, capture_output=True, check=False)


@contextmanager
def null_sink(
    channels: int = 1,
    name: str = NAME,
    channel_map: str | None = None,
    kind: str = PULSEAUDIO,
) -> Iterator[Server]:
    """Run a server with one sink of this name (one word) and these channels.

    Environment variables lead this process, and those it starts, to that server for as long as the
    context lasts. Raises SinkError.
    """
    missing = [name for name in NEEDED if shutil.which(name) is None]
    if missing:
        raise SinkError(f"{', '.join(missing)} missing: run .ci/toolchains")
    with tempfile.TemporaryDirectory(prefix="hapticvlm-sink-") as folder:
        server = Server(Path(folder), kind, [], channels, name, channel_map)
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
def recording(channels: int = 1, channel_map: str | None = None) -> Iterator[Recording]:
    """Record the sink's monitor as fast as the server hands it out, interleaved, once it does.

    `channel_map` is the sink's: PipeWire sorts channels by their names whatever it is told.
    """
    command = ["parec", "--device=palm.monitor", "--raw", "--format=float32le", "--latency-msec=1"]
    process = subprocess.Popen(
        [*command, f"--rate={RATE_HZ}", f"--channels={channels}", "--no-remix", "--no-remap"]
        + ([f"--channel-map={channel_map}"] if channel_map else []),
        stdout=subprocess.PIPE,
        bufsize=0,
    )
    recorded = Recording(process)
    reader = threading.Thread(target=_record, args=(recorded,), name="recorder", daemon=True)
    reader.start()
    recorded.reader = reader
    try:
        until(lambda: recorded.chunks)  # what is played before is not recorded
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
