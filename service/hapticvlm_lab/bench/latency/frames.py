"""The path of frames under steady load: every frame must be answered, and memory stay flat.

A process of its own streams different 40 KB frames at 60 a second. The cost of frames for
the gateway is its processor time less that of an equally long rest, divided by all frames that were
sent, and by those that were recognised.

Beside it, one frame's recognition (decode, cut, embed, match) is measured without sockets or
processes, for frames of several sizes with a mask or a region. Its floor is the bare network, which
takes turns with it. Both are processor time, so that other programs are not charged to them.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from io import BytesIO

import numpy as np
from PIL import Image
from rich.console import Console

from hapticvlm import __version__
from hapticvlm.client.local_service import running
from hapticvlm.messages import Frame, Region
from hapticvlm.vision import pictures
from hapticvlm.vision.encoders.encoder import DEFAULT, SHIPPED
from hapticvlm.vision.encoders.onnx_encoder import INPUT, OUTPUT, load_onnx_encoder
from hapticvlm.vision.frame_recogniser import FrameRecogniser
from hapticvlm.vision.galleries.storage import load_gallery
from hapticvlm_lab.bench.rigs import Process, helper, report_of, spent_s, spread

RATE_HZ = 60.0
FRAME_BYTES = 40_000
SETTLE_S = 5.0
SAMPLE_S = 1.0
REST_S = 5.0
ROUNDS = 60  # of the recognition alone
JPEG_QUALITY = 80
OBJECT = (0.34, 0.28, 0.32, 0.44)  # left, top, width and height of the object, shares of the frame


def run(*, seconds: float, as_json: bool) -> int:
    """Measure and print the figures, or JSON."""
    console = Console(quiet=as_json)
    alone = recognition_ms()
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
        "recognition_ms": alone,
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
        if value is not alone:
            console.print(f"{name:<16} {value}", highlight=False)
    console.print(f"{'recognition alone, ms':<28} {'median':>7} {'p99':>7} {'networks':>8}")
    for name, took in alone.items():
        row = f"{name:<28} {took['median']:>7.2f} {took['p99']:>7.2f} {took['networks']:>8.2f}"
        console.print(row, highlight=False)
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


def recognition_ms(rounds: int = ROUNDS) -> dict[str, dict[str, float]]:
    """Time the recognition of single frames, and the bare network, in turns: processor ms.

    `networks` is the median over that of the bare network.
    """
    encoder = load_onnx_encoder(SHIPPED / DEFAULT)
    recogniser = FrameRecogniser(encoder, load_gallery(encoder=encoder))
    frames = {
        "448 px": _frame(448),
        "448 px, mask": _frame(448, bits=8),
        "960 px, region": _frame(960),
        "960 px, mask": _frame(960, bits=8),
        "960 px, mask of 1 bit": _frame(960, bits=1),
        "1920 px, mask": _frame(1920, bits=8),
        "1920 px, mask of 1 bit": _frame(1920, bits=1),
    }
    cut = pictures.crop(frames["960 px, mask"], encoder.side)
    crops = np.dstack([cut.image, cut.mask])[None]
    stages: dict[str, Callable[[], object]] = {
        "network": lambda: encoder.session.run([OUTPUT], {INPUT: crops}),
        **{f"{name}, cut": _cutting(frame, encoder.side) for name, frame in frames.items()},
        **{name: _recognising(frame, recogniser) for name, frame in frames.items()},
    }
    times: dict[str, list[float]] = {name: [] for name in stages}
    for stage in stages.values():
        stage()  # the first is slower
    for _ in range(rounds):
        for name, stage in stages.items():
            started = time.process_time()
            stage()
            times[name].append((time.process_time() - started) * 1000.0)
    floor = float(np.median(times["network"]))
    return {
        name: {**spread(took), "networks": round(float(np.median(took)) / floor, 2)}
        for name, took in times.items()
    }


def _cutting(frame: Frame, side: int) -> Callable[[], object]:
    return lambda: pictures.crop(frame, side)


def _recognising(frame: Frame, recogniser: FrameRecogniser) -> Callable[[], object]:
    return lambda: recogniser.recognise(frame, "alone", 0.0, force=True)


def _frame(side: int, bits: int | None = None) -> Frame:
    """Draw a frame of smooth colours and fine grain; an object in it by a region or a mask."""
    import simplejpeg

    rng = np.random.default_rng(side)
    coarse = rng.integers(40, 210, (side // 32, side // 32, 3), np.uint8)
    smooth = np.asarray(Image.fromarray(coarse).resize((side, side), Image.Resampling.BICUBIC))
    pixels = np.clip(smooth + rng.normal(0.0, 1.0, (side, side, 1)), 0, 255).astype(np.uint8)
    left, top, width, height = OBJECT
    return Frame(
        id=1,
        captured_at=0.0,
        format="jpeg",
        width=side,
        height=side,
        origin="top",
        image=simplejpeg.encode_jpeg(pixels, quality=JPEG_QUALITY),
        region=Region(x=left, y=top, w=width, h=height) if bits is None else None,
        mask=None if bits is None else _ellipse(side, bits),
    )


def _ellipse(side: int, bits: int) -> bytes:
    left, top, width, height = OBJECT
    y, x = np.mgrid[:side, :side] / side
    inside = ((x - left) / width - 0.5) ** 2 + ((y - top) / height - 0.5) ** 2 < 0.25
    file = BytesIO()
    Image.fromarray(inside).convert("1" if bits == 1 else "L").save(file, "PNG")
    return file.getvalue()
