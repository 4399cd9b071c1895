"""`hapticvlm measure speaker`: from a contact to the first sample that an audio output plays.

Sound is measured where another program receives it. A private PulseAudio daemon has one sink that
plays into nothing; `parec` records the sink's monitor, and the time at which a chunk arrives there
is the time that counts. A strike is put into the ring of the audio engine; its delay ends with the
first chunk that holds a sample other than zero. That includes the delay of the sound server, and
nothing is taken off for the place of the sample within its chunk. The table in docs/figures.md
tells what a bare audio program needs on the same sink.

Three clocks are involved. The engine renders a block each time the output asks for one, so the
output's clock paces it. Commands and arrivals carry times of the monotonic clock, which all
processes of a machine share. Without an output a virtual clock paces the engine: a loop that sleeps
until the deadline of the next block. It misses deadlines when the machine lets it sleep too long,
so a bare loop on the same deadlines, which renders nothing, runs beside it as the floor (`python -m
hapticvlm_lab.bench.audio SECONDS BLOCK REALTIME` prints its figures).

Gaps are runs of exact zeros in the recording of a slide that is held: real vibration is never
exactly zero for so long.
"""

from __future__ import annotations

import gc
import json
import os
import random
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from hapticvlm import __version__
from hapticvlm.client.local_service import running
from hapticvlm.devices.speaker.engine import AudioSettings
from hapticvlm.devices.speaker.speaker import Speaker
from hapticvlm.errors import HapticVLMError
from hapticvlm.processes.priority import request_priority
from hapticvlm.rendering.vibration.vibration import RATE_HZ, Motion
from hapticvlm.rendering.vibration.voices import Command
from hapticvlm_lab.bench.rigs import (
    first_line,
    helper,
    priority,
    report_of,
    service_status,
    set_priority,
)

NAME = "Palm"
NEEDED = ("pulseaudio", "pactl", "parec")
START_S = 20.0  # until a sound server answers
SERVER_PRIORITY = 25

BLOCKS = (64, 128, 256, 512)
LOAD = ("80.0", "40000", "3")  # frames/s, bytes a frame, scenes: as many as are admitted
STRIKE_LEASE_S = 0.03
SLIDE_LEASE_S = 0.5
RENEWAL_S = 0.05
APART_S = 0.3  # a strike's fade and the longest buffers are over by then
ARRIVES_WITHIN_S = 0.14
SLIDE_S = 5.0
SETTLE_S = 2.0
ROW_S = 60.0  # the longest that the parts of a row need to start and stop
GAP_SAMPLES = 16

_CHUNK_BYTES = 1 << 16
_QUAD = ("front-left", "front-right", "rear-left", "rear-right")  # as of a DualSense


class SinkError(HapticVLMError):
    """Raised when a sound server cannot run here; the text says why."""


@dataclass(frozen=True, slots=True)
class Plan:
    """Seconds of each row and of the virtual clock (0: leave it out), block sizes, priority."""

    seconds: float
    blocks: Sequence[int]
    clock_s: float
    realtime: bool


@dataclass(frozen=True, slots=True)
class Delays:
    """Delays in ms of those that arrived, and how many did not."""

    delays_ms: NDArray[np.float64]
    missed: int

    def summary(self, name: str) -> dict[str, Any]:
        """Return the figures, None where nothing arrived."""
        has_some = self.delays_ms.size > 0
        return {
            f"{name}_n": self.delays_ms.size,
            f"{name}_missed": self.missed,
            f"{name}_median_ms": round(float(np.median(self.delays_ms)), 2) if has_some else None,
            f"{name}_p99_ms": round(float(np.percentile(self.delays_ms, 99)), 2)
            if has_some
            else None,
        }


def run(plan: Plan, *, as_json: bool) -> int:
    """Measure, print a table or JSON. Raises SinkError, DeviceError."""
    console = Console(quiet=as_json, width=150)
    clock = None
    if plan.clock_s:
        with console.status("virtual clock"):
            clock = virtual_underruns(plan.clock_s, realtime=plan.realtime)
    rows = _rows(plan, console) if plan.seconds else []
    if rows:
        console.print(_table(rows))
    if clock:
        console.print(_virtual_line(clock))
    if as_json:
        versions = {"hapticvlm": __version__, "cpus": os.cpu_count(), "server": _server_version()}
        print(json.dumps({"measure": "speaker", **versions, "rows": rows, "clock": clock}))
    return 0


def _rows(plan: Plan, console: Console) -> list[dict[str, Any]]:
    # The load outlasts all rows of its condition: it is started once, since a service takes a
    # second to start and the first frames of a scene cost more than the later ones.
    rows = []
    longest_s = (plan.seconds + SLIDE_S + ROW_S) * len(plan.blocks)
    with null_sink() as server, priority(plan.realtime):
        for name, during in (("idle", no_load), ("encoder busy", load)):
            with console.status(name), during(longest_s) as busy_s:
                for block in plan.blocks:
                    started = time.monotonic()
                    before = busy_s()
                    row = _row(server, block, plan)
                    busy = (busy_s() - before) / (time.monotonic() - started)
                    rows.append({"condition": name, **row, "recogniser_busy": round(busy, 2)})
    return rows


def _row(server: Server, block: int, plan: Plan) -> dict[str, Any]:
    speaker = Speaker(AudioSettings(NAME, block, realtime=plan.realtime))
    with recording() as recorded:
        speaker.start()
        try:
            raise_priority(plan.realtime, server, recorded)
            time.sleep(SETTLE_S)
            before = speaker.underruns
            strikes = _strike(speaker, plan.seconds)
            holes, hole_ms = gaps(_slide(speaker, recorded))
            status = speaker.status()
            underruns = speaker.underruns - before
        finally:
            speaker.close()
    return {
        "block": block,
        **late(recorded.chunks, strikes).summary("touch"),
        "underruns": underruns,
        "gaps": holes,
        "gaps_ms": round(hole_ms, 1),
        "realtime": status.realtime,
        "load": round(os.getloadavg()[0], 1),
    }


def _strike(speaker: Speaker, seconds: float) -> list[float]:
    """Strike again and again at uneven intervals; return when."""
    rng = random.Random(0)
    moments: list[float] = []
    ends_at = time.monotonic() + seconds
    while time.monotonic() < ends_at:
        moments.append(time.monotonic())
        speaker.play(hand_on_wood("strike", len(moments), STRIKE_LEASE_S))
        time.sleep(APART_S + rng.uniform(0.0, 0.02))  # never in step with the blocks
    return moments


def _slide(speaker: Speaker, recorded: Recording) -> NDArray[np.float32]:
    """Hold a slide, and return its recording."""
    begun = len(recorded.chunks)
    ends_at = time.monotonic() + SLIDE_S
    while time.monotonic() < ends_at:
        speaker.play(hand_on_wood("slide", 1, SLIDE_LEASE_S))
        time.sleep(RENEWAL_S)
    data = b"".join(chunk for _, chunk in recorded.chunks[begun:])
    return np.frombuffer(data, np.float32)


def late(chunks: Sequence[tuple[float, bytes]], moments: Sequence[float]) -> Delays:
    """Return how long after each moment the first chunk that is not silent arrived.

    A moment at which something still sounded cannot be judged and counts as missed.
    """
    # A chunk that arrived before the moment tells whether something still sounded then: the first
    # sound after it could otherwise be the end of the strike before.
    arrivals = np.array([arrived for arrived, _ in chunks])
    sounds = np.array([np.frombuffer(data, np.float32).any() for _, data in chunks])
    delays = []
    for moment in moments:
        first = int(np.searchsorted(arrivals, moment, "right"))
        hits = np.flatnonzero(sounds[first:])
        is_clear = first > 0 and not sounds[first - 1] and hits.size > 0
        if is_clear and (delay := arrivals[first + hits[0]] - moment) <= ARRIVES_WITHIN_S:
            delays.append(delay * 1000.0)
    return Delays(np.array(delays), len(moments) - len(delays))


def gaps(samples: NDArray[np.float32]) -> tuple[int, float]:
    """Return the number of runs of exact zeros between sounds, and their length in ms."""
    # Zeros before the first sound and after the last are silence, not gaps: only distances between
    # two sounding samples count, and short ones occur in any wave that crosses zero.
    sounding = np.flatnonzero(samples)
    lengths = np.diff(sounding) - 1
    long = lengths[lengths >= GAP_SAMPLES]
    return long.size, float(long.sum() * 1000.0 / RATE_HZ)


def _table(rows: list[dict[str, Any]]) -> Table:
    columns = ("condition", "block", "n", "median / p99", "missed", "underruns", "gaps", "busy")
    title = "from a command to its first sample at a null sink, ms"
    table = Table(*columns, "load", title=title)
    for row in rows:
        table.add_row(
            *(row["condition"], str(row["block"]), str(row["touch_n"])),
            f"{row['touch_median_ms']} / {row['touch_p99_ms']}",
            str(row["touch_missed"]),
            str(row["underruns"]),
            f"{row['gaps']}, {row['gaps_ms']} ms",
            f"{row['recogniser_busy']:.0%}",
            str(row["load"]),
        )
    return table


def _server_version() -> str:
    command = ["pulseaudio", "--version"]
    return subprocess.run(command, capture_output=True, text=True, check=False).stdout.strip()


def hand_on_wood(interaction: str, seed: int, lease_s: float) -> Command:
    """Return the command of a hand that strikes or slides over wood."""
    return Command(
        hand=1,
        material="wood",
        interaction=interaction,
        onset=interaction == "strike",
        motion=Motion(0.5, 2.0),
        seed=seed,
        expires_at=time.monotonic() + lease_s,
    )


@dataclass(slots=True)
class Server:
    """One private PulseAudio daemon, which can be killed and started again."""

    folder: Path
    process: subprocess.Popen[bytes] | None = None
    channels: int = 1
    name: str = NAME

    @property
    def _sink(self) -> str:
        """The null sink, as a module's arguments."""
        shape = f"rate={RATE_HZ} channels={self.channels} format=float32le"
        if self.channels == len(_QUAD):
            shape += f" channel_map={','.join(_QUAD)}"
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
def null_sink(channels: int = 1, name: str = NAME) -> Iterator[Server]:
    """Run a server with one sink of this name (one word) and so many channels.

    Environment variables lead this process, and those it starts, to that server for as long as the
    context lasts. Raises SinkError.
    """
    missing = [name for name in NEEDED if shutil.which(name) is None]
    if missing:
        raise SinkError(f"{', '.join(missing)} missing: install pulseaudio and pulseaudio-utils")
    with tempfile.TemporaryDirectory(prefix="hapticvlm-sink-") as folder:
        server = Server(Path(folder), channels=channels, name=name)
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


def raise_priority(realtime: bool, server: Server, recording: Recording) -> None:
    """Give real-time priority to the sound server and the recorder too.

    Otherwise their waiting for the processor would count as delay of the audio engine.
    """
    ids = [process.pid for process in (server.process, recording.process) if process is not None]
    if recording.reader is not None and recording.reader.native_id is not None:
        ids.append(recording.reader.native_id)  # a thread of ours, which does not inherit priority
    for number in ids if realtime else ():
        set_priority(number, SERVER_PRIORITY)


@contextmanager
def no_load(seconds: float) -> Iterator[Callable[[], float]]:  # noqa: ARG001 - as `load`
    """Keep nothing busy; the counterpart of `load`."""
    yield lambda: 0.0


@contextmanager
def load(seconds: float) -> Iterator[Callable[[], float]]:
    """Keep the encoder of a service busy; yields a function that returns its busy time, s."""
    rate, size, scenes = LOAD
    with (
        running(["--no-realtime"]) as service,
        helper("latency.load", service.url, rate, seconds, size, scenes) as process,
    ):
        first_line(process)
        yield lambda: float(service_status(service)["recogniser"]["busy_s"])


def virtual_underruns(seconds: float, *, realtime: bool) -> dict[str, Any]:
    """Count the underruns of the virtual clock in a held slide, beside those of a bare loop."""
    settings = AudioSettings(realtime=realtime)
    speaker = Speaker(settings)
    speaker.start()
    started = time.monotonic()
    stolen_before = stolen_s()
    try:
        with helper("audio", seconds, settings.block, int(realtime)) as bare:
            while time.monotonic() - started < seconds:
                speaker.play(hand_on_wood("slide", 1, SLIDE_LEASE_S))
                time.sleep(0.1)
            status = speaker.status()
            floor = report_of(bare)
    finally:
        speaker.close()
    stolen = stolen_s()
    lost_s = None if stolen is None or stolen_before is None else round(stolen - stolen_before, 2)
    return {
        "seconds": seconds,
        "stolen_s": lost_s,
        "underruns": status.underruns,
        "samples": status.samples,
        "lost": status.lost,
        "realtime": status.realtime,
        "floor": floor,
    }


def _virtual_line(clock: dict[str, Any]) -> str:
    missed = clock["floor"]["missed"]
    text = f"virtual clock, {clock['seconds']:.0f} s: {clock['underruns']} underruns"
    text += f"; a bare loop missed {missed}"
    stolen = clock["stolen_s"]
    return text if stolen is None else f"{text}; the host withheld {stolen:g} s of processor time"


def stolen_s() -> float | None:
    """Return how long the host of a virtual machine has withheld its processors so far, s.

    No priority helps against that: for every program within, time just jumps. None: not known.
    """
    try:
        counters = Path("/proc/stat").read_text(encoding="ascii").splitlines()[0].split()
        return int(counters[8]) / os.sysconf("SC_CLK_TCK")
    except (OSError, IndexError, ValueError):
        return None


def keep(seconds: float, block: int, *, realtime: bool) -> dict[str, object]:
    """Sleep from deadline to deadline; return how many were missed by more than a block."""
    has_priority = realtime and request_priority()
    # The virtual clock runs with the collector off as well, so the floor does.
    gc.disable()
    period = block / RATE_HZ
    deadline = time.monotonic()
    ends_at = deadline + seconds
    missed = 0
    worst_s = 0.0
    while deadline < ends_at:
        deadline += period
        ahead = deadline - time.monotonic()
        if ahead > 0:
            time.sleep(ahead)
        # Late by less than a block is caught up by the blocks after it. Later than that the clock
        # starts over from now, as an output does after an underrun.
        elif ahead < -period:
            missed += 1
            worst_s = max(worst_s, -ahead)
            deadline = time.monotonic()
    return {"missed": missed, "worst_ms": round(worst_s * 1000.0, 2), "realtime": has_priority}


if __name__ == "__main__":
    seconds, block, is_realtime = sys.argv[1:]
    print(json.dumps(keep(float(seconds), int(block), realtime=is_realtime == "1")))
