"""`hapticvlm measure shared-recogniser`: many simulated scenes against one shared recogniser.

Frames are recorded, scenes simulated, processes real. Phases: one scene alone (batches of 1), all
scenes at once, and on Ray all scenes while the replica is killed and while the gallery is replaced.

A recogniser that serves many scenes gains by batching: one pass of the network over b crops costs

    S(b) = fixed + each b      core-seconds,

so b crops in one pass save b - 1 times the fixed part. The floor is this curve of the bare encoder
on one thread, measured in the same run. The gain of the deployment is computed from the
core-seconds of its own batches, so that HTTP and queues do not count against the network.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
import time
import urllib.request
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from hapticvlm import __version__
from hapticvlm.vision.encoders.encoder import Encoder
from hapticvlm.vision.encoders.loading import load_encoder
from hapticvlm.vision.galleries.storage import load_gallery, save_gallery
from hapticvlm.vision.pictures import Crop
from hapticvlm_lab.bench.shared_recogniser_scenes import Plan, Scenes, Tally, Truth, recorded
from hapticvlm_recogniser_app.replies import load_galleries
from hapticvlm_recogniser_app.settings import AppSettings, Live, Model, Scale

CAPTURE = Path("examples/captures/living_room")
NAME = "arcade"
PORT = 19_791
URL = f"http://127.0.0.1:{PORT}"
ALONE_S = 4.0
READY_S = 120.0
SETTLE_S = 2.0
RAY = "ray"
SIZES = (1, 2, 4, 8, 16, 32, 64)  # crops of a pass
PASSES = 24


@dataclass(frozen=True, slots=True)
class Curve:
    """Core-seconds of a pass by its size, and the line through them."""

    passes_s: Mapping[int, float]
    fixed_s: float
    each_s: float

    def service_s(self, size: int) -> float:
        """Return the core-seconds of a pass over `size` crops: measured, or else by the line."""
        return self.passes_s.get(size, self.fixed_s + self.each_s * size)

    def rate(self, size: int) -> float:
        """Return the recognitions per core-second in batches of `size`."""
        return size / self.service_s(size)


def measure_curve(encoder: Encoder, crops: Sequence[Crop]) -> Curve:
    """Time the encoder's passes on one thread: the median of PASSES for each size."""
    passes: dict[int, float] = {}
    for size in SIZES:
        batch = [crops[number % len(crops)] for number in range(size)]
        encoder.embed(batch)
        took = []
        for _ in range(max(3, PASSES // max(1, size // 4))):
            started = time.thread_time()
            encoder.embed(batch)
            took.append(time.thread_time() - started)
        passes[size] = float(np.median(took))
    return fit(passes)


def fit(passes_s: Mapping[int, float]) -> Curve:
    """Fit the line by least squares of the relative error, so that small batches count too."""
    # Dividing both sides by the measured time makes the error of each size relative: in absolute
    # terms a pass over 64 crops would outweigh all small ones, which most batches are.
    sizes = np.array(list(passes_s), np.float64)
    took = np.array(list(passes_s.values()))
    columns = np.stack([np.ones_like(sizes), sizes], axis=1) / took[:, None]
    (fixed, each), *_ = np.linalg.lstsq(columns, np.ones_like(took), rcond=None)
    return Curve(dict(passes_s), max(0.0, float(fixed)), float(each))


def gain(batches: Mapping[int, int], curve: Curve) -> float:
    """Return how many times more a core-second recognises in these batches than one by one."""
    crops = sum(size * count for size, count in batches.items())
    used = sum(count * curve.service_s(size) for size, count in batches.items())
    return crops / used / curve.rate(1)


def deployed_gain(batches: Mapping[int, int], used_s: Mapping[int, float]) -> float | None:
    """Return the gain of a deployment, by the core-seconds of its batches; None without one of 1.

    batches: the number of each size; used_s: core-seconds of all batches of a size.
    """
    if not batches.get(1) or not used_s.get(1):
        return None
    crops = sum(size * count for size, count in batches.items())
    return crops / sum(used_s.values()) / (batches[1] / used_s[1])


@dataclass(frozen=True, slots=True)
class Load:
    """The load: scenes, frames/s and seconds of each, and how the recogniser is deployed."""

    scenes: int
    rate_hz: float
    seconds: float
    max_age_ms: float
    batch: int
    replicas: int
    engine: str


def run(load: Load, *, as_json: bool) -> int:
    """Measure, print the tables and, last, one JSON object."""
    console = Console(quiet=as_json, width=150)
    encoder = load_encoder()
    crops = recorded(CAPTURE, encoder)
    curve = measure_curve(encoder, crops)
    with tempfile.TemporaryDirectory(prefix="hapticvlm-recogniser-") as folder:
        old, new = _galleries(Path(folder))
        named = [load_galleries({NAME: str(path)}, encoder)[NAME] for path in (old, new)]
        hashes = [gallery.identity.hash for gallery in named]
        truth = Truth(named)
        settings = _settings(load, old)
        phases: list[dict[str, Any]] = []
        with _running(settings, load.engine):
            plan = Plan(load.scenes, load.rate_hz, load.seconds, load.max_age_ms, NAME)
            events: list[tuple[str, Plan, Callable[[], None] | None]] = [
                ("one scene alone", replace(plan, scenes=1, seconds=ALONE_S), None),
                ("all scenes", plan, None),
            ]
            if load.engine == RAY:
                events += [
                    ("replica killed", plan, _kill),
                    ("gallery replaced", plan, lambda: _replace(settings, new)),
                ]
            for name, wanted, event in events:
                with console.status(name):
                    scenes = Scenes(URL, wanted, crops, truth)
                    phases.append({"phase": name, **_phase(scenes, wanted, event)})
        if load.engine == RAY:
            phases[-1]["ended_with_new"] = phases[-1]["last_hashes"] == [hashes[1]]
    result = {
        "measure": "shared-recogniser",
        "hapticvlm": __version__,
        "simulated_scenes": load.scenes,
        "rate_hz": load.rate_hz,
        "max_age_ms": load.max_age_ms,
        "batch": load.batch,
        "engine": load.engine,
        "replicas": load.replicas,
        "cores": os.cpu_count(),
        "curve_core_ms": {str(b): round(1e3 * s, 3) for b, s in curve.passes_s.items()},
        "curve_line_ms": [round(1e3 * curve.fixed_s, 3), round(1e3 * curve.each_s, 3)],
        "gain": _gains(phases, curve),
        "phases": phases,
    }
    _print(console, result)
    if as_json:
        print(json.dumps(result))
    return 0


def _galleries(folder: Path) -> tuple[Path, Path]:
    """Write the shipped gallery, and another that is less sure of everything."""
    gallery = load_gallery(encoder=load_encoder())
    calibration = replace(gallery.calibration, scale=0.5 * gallery.calibration.scale)
    paths = folder / "old.npz", folder / "new.npz"
    save_gallery(gallery, paths[0])
    save_gallery(replace(gallery, calibration=calibration), paths[1])
    return paths


@contextmanager
def _running(settings: AppSettings, engine: str) -> Iterator[None]:
    """Run the recogniser on this engine until the block ends."""
    if engine == RAY:
        from hapticvlm_recogniser_app.engine_ray import running

        with running(settings, {"host": "127.0.0.1", "port": PORT, "keep_alive_timeout_s": 90}):
            yield
        return
    galleries = [f"--gallery={name}={path}" for name, path in settings.live.galleries.items()]
    command = [sys.executable, "-m", "hapticvlm", "recogniser-app", f"--port={PORT}", *galleries]
    command += [f"--batch={settings.live.batch}", f"--queue={settings.scale.queue}"]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    try:
        yield
    finally:
        process.terminate()
        process.wait()


def _settings(load: Load, gallery: Path) -> AppSettings:
    return AppSettings(
        Model(is_open=True),
        Live({NAME: str(gallery)}, batch=load.batch),
        Scale((load.replicas, load.replicas), cpus=0.5, queue=4 * load.scenes),
    )


def _phase(scenes: Scenes, plan: Plan, event: Callable[[], None] | None) -> dict[str, Any]:
    _wait_until_idle()
    before = _health()
    used = _used_s()
    scenes.start()
    if event is not None:
        time.sleep(0.5 + plan.seconds / 3)
        event()
    tallies = scenes.finish()
    after = _health()
    summary = _summary(tallies, plan)
    is_same = before["pid"] == after["pid"]
    if is_same:
        spent = _used_s() - used
        summary["core_ms_per_look"] = round(1e3 * spent / max(1, summary["answered"]), 2)
        summary["batches"] = _difference(before["batches"], after["batches"])
        summary["encode_cpu_s"] = _difference(before["encode_cpu_s"], after["encode_cpu_s"])
    return summary


def _summary(tallies: list[Tally], plan: Plan) -> dict[str, Any]:
    ages = np.array([age for tally in tallies for age in tally.ages_ms] or [np.nan])
    ratios = [tally.answered / max(1, tally.offered) for tally in tallies]
    reasons: Counter[str] = sum((tally.reasons for tally in tallies), Counter())
    answered = sum(tally.answered for tally in tallies)
    return {
        "scenes": plan.scenes,
        "seconds": plan.seconds,
        "offered": sum(tally.offered for tally in tallies),
        "answered": answered,
        "answers_per_s": round(answered / plan.seconds, 1),
        "superseded": sum(tally.superseded for tally in tallies),
        "stale": sum(tally.stale for tally in tallies),
        "failed": sum(tally.failed for tally in tallies),
        "wrong_gallery": sum(tally.wrong for tally in tallies),
        "age_ms": [round(float(np.percentile(ages, share)), 1) for share in (50, 99)],
        "longest_gap_s": round(_longest_gap_s(tallies), 2),
        "fairness": round(max(ratios) / min(ratios), 2) if min(ratios) else None,
        "last_hashes": sorted({tally.last_hash for tally in tallies}),
        "reasons": dict(reasons.most_common(4)),
    }


def _longest_gap_s(tallies: list[Tally]) -> float:
    """Return the longest time between two answers to any scene."""
    times = np.sort([at for tally in tallies for at in tally.answered_at])
    return float(np.diff(times).max()) if times.size > 1 else float("nan")


def _gains(phases: list[dict[str, Any]], curve: Curve) -> dict[str, float | None]:
    """Compare the gain of batching: bare, and in the replica (the first two phases together)."""
    batches: Counter[int] = Counter()
    used: Counter[str] = Counter()
    for phase in phases[:2]:
        batches.update({int(size): count for size, count in phase.get("batches", {}).items()})
        used.update(phase.get("encode_cpu_s", {}))
    if not batches:
        return {"bare": None, "deployed": None}
    deployed = deployed_gain(batches, {int(size): s for size, s in used.items()})
    return {"bare": round(gain(batches, curve), 3), "deployed": deployed}


def _difference(before: Mapping[str, float], after: Mapping[str, float]) -> dict[str, float]:
    gained = {size: after[size] - before.get(size, 0) for size in after if size != "0"}
    return {size: count for size, count in gained.items() if count > 0}


def _health() -> dict[str, Any]:
    with urllib.request.urlopen(f"{URL}/v1/health", timeout=60) as answer:
        health: dict[str, Any] = json.load(answer)
    return health


def _wait_until_idle() -> None:
    """Wait until a replica answers, and until the requests of the phase before are done."""
    ends = time.monotonic() + READY_S
    while time.monotonic() < ends:
        with suppress(OSError), urllib.request.urlopen(f"{URL}/v1/ready", timeout=5):
            time.sleep(SETTLE_S)
            return
        time.sleep(0.2)


def _used_s() -> float:
    """Return the core-seconds of every process of the deployment so far, Ray's included."""
    import psutil

    total = 0.0
    for process in psutil.Process().children(recursive=True):
        try:
            times = process.cpu_times()
        except psutil.NoSuchProcess:
            continue
        total += times.user + times.system
    return total


def _kill() -> None:
    os.kill(_health()["pid"], signal.SIGKILL)


def _replace(settings: AppSettings, gallery: Path) -> None:
    from hapticvlm_recogniser_app.engine_ray import deploy

    deploy(replace(settings, live=replace(settings.live, galleries={NAME: str(gallery)})))


def _print(console: Console, result: dict[str, Any]) -> None:
    counts = ("phase", "offered", "answered", "superseded", "stale", "failed", "wrong_gallery")
    names = (*counts, "answers_per_s", "age_ms", "longest_gap_s", "fairness", "core_ms_per_look")
    title = f"{result['simulated_scenes']} simulated scenes, {result['rate_hz']:g}/s"
    table = Table(*(name.replace("_", " ") for name in names), title=title)
    for phase in result["phases"]:
        table.add_row(*(str(phase.get(name, "-")) for name in names))
    console.print(table)
    columns = ("batch", "core-ms a pass", "core-ms a look")
    bare = Table(*columns, title="bare encoder, one thread")
    for size, took in result["curve_core_ms"].items():
        bare.add_row(size, f"{took:.2f}", f"{took / int(size):.2f}")
    console.print(bare)
    console.print(f"gain of batching: {result['gain']}")
