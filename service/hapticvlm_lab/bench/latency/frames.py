"""The path of frames under steady load: every frame must be answered, and memory stay flat.

A process of its own streams different 40 KB frames at 60 a second. The floor is the recogniser's
own work on one frame (decode, embed, match) without sockets or processes. The cost of frames for
the gateway is its processor time less that of an equally long rest, divided by all frames that were
sent, and by those that were recognised.
"""

from __future__ import annotations

import json
import time
from typing import Any

from rich.console import Console

from hapticvlm import __version__
from hapticvlm.client.local_service import running
from hapticvlm.messages import Frame
from hapticvlm.vision.encoders.loading import load_encoder
from hapticvlm.vision.frame_recogniser import FrameRecogniser
from hapticvlm.vision.galleries.storage import load_gallery
from hapticvlm_lab.bench.latency.load import SIDE, pictures
from hapticvlm_lab.bench.rigs import Process, helper, report_of, spent_s, spread

RATE_HZ = 60.0
FRAME_BYTES = 40_000
SETTLE_S = 5.0
SAMPLE_S = 1.0
REST_S = 5.0
FLOOR_FRAMES = 60


def run(*, seconds: float, as_json: bool) -> int:
    """Measure and print the figures, or JSON."""
    console = Console(quiet=as_json)
    floor = _floor_ms()
    with running() as service, console.status(f"{seconds:.0f} s at {RATE_HZ:.0f} frames/s"):
        ready_s = service.seconds_to_ready
        resting = _memory_mb(service.process.pid)
        rest_s = _rest_s(service.process.pid)
        before_s = spent_s(service.process.pid)
        rig = (service.url, RATE_HZ, seconds, FRAME_BYTES)
        with helper("latency.load", *rig) as load:
            memory = _watch_memory(load, service.process.pid)
            frames = report_of(load)
        # The gateway ticks and sends telemetry without frames too; that is not charged to them.
        used_s = spent_s(service.process.pid) - before_s - rest_s * frames["seconds"]
    looks = frames["answers"].get("decision", 0)
    answered = sum(frames["answers"].values())
    settled = memory[int(SETTLE_S / SAMPLE_S) :] or memory
    result = {
        "measure": "frames",
        "hapticvlm": __version__,
        **frames,
        "answered": answered,
        "all_answered": answered == frames["sent"],
        "looks_per_s": round(looks / frames["seconds"], 1),
        "gateway_ms": {
            "a_frame": round(1e3 * used_s / frames["sent"], 2),
            "a_look": round(1e3 * used_s / max(looks, 1), 2),
            "a_second_at_rest": round(1e3 * rest_s, 1),
        },
        "floor_look_ms": floor,
        "ready_s": round(ready_s, 2),
        "memory_mb": {
            "resting": resting,
            "after_5_s": settled[0],
            "at_end": settled[-1],
            "most": max(memory),
        },
    }
    if as_json:
        print(json.dumps(result))
    for name, value in result.items():
        console.print(f"{name:<16} {value}", highlight=False)
    return 0 if result["all_answered"] else 1


def _watch_memory(load: Process, pid: int) -> list[float]:
    memory = [_memory_mb(pid)]
    while load.poll() is None:
        time.sleep(SAMPLE_S)
        memory.append(_memory_mb(pid))
    return memory


def _rest_s(pid: int) -> float:
    """Return the processor time that a process uses in a second of rest, s."""
    before = spent_s(pid)
    time.sleep(REST_S)
    return (spent_s(pid) - before) / REST_S


def _memory_mb(pid: int) -> float:
    """Return the memory of a process and its children; shared pages count once, on Linux."""
    import psutil

    gateway = psutil.Process(pid)
    family = [gateway, *gateway.children(recursive=True)]
    held = [process.memory_full_info() for process in family]
    return round(float(sum(getattr(each, "pss", each.rss) for each in held)) / 2**20, 1)


def _floor_ms() -> dict[str, float]:
    encoder = load_encoder()
    recogniser = FrameRecogniser(encoder, load_gallery(encoder=encoder))
    took = []
    for number, image in enumerate(pictures(FLOOR_FRAMES, FRAME_BYTES, seed=1), 1):
        size: dict[str, Any] = {"width": SIDE, "height": SIDE}
        frame = Frame(id=number, captured_at=0.0, format="jpeg", origin="top", image=image, **size)
        started = time.perf_counter()
        recogniser.recognise(frame, "floor", 0.0, force=True)
        took.append((time.perf_counter() - started) * 1000.0)
    return spread(took)
