"""Keeps a vision-language model of random weights busy, as the VLM worker would at its worst.

`python -m hapticvlm_lab.bench.latency.burn SECONDS THREADS` builds a Qwen2-VL of a few hundred
million parameters, prints "burning" after the first pass, reads pictures without a pause at the
priority of the VLM worker, and prints one JSON object at the end: the passes, and the cores that it
really used.
"""

from __future__ import annotations

import json
import os
import sys
import tempfile
import time
from contextlib import suppress
from pathlib import Path

import numpy as np

from hapticvlm.vlm import contract
from hapticvlm.vlm.contract import Picture, Vlm, VlmError, VlmSettings
from hapticvlm.vlm.limits import NICE
from hapticvlm.vlm.local import load_vlm, prepare_process
from hapticvlm_lab.bench import random_vlm

SIZES = random_vlm.Sizes(1024, 4096, 8, 16, 2, (8, 12, 12), 768, 12, 12, 32000)


def burn(seconds: float, threads: int) -> dict[str, object]:
    """Read pictures for `seconds` after a first one; return passes and cores used."""
    pictures = np.random.default_rng(0).integers(0, 255, (8, 448, 448, 3), np.uint8)
    with tempfile.TemporaryDirectory() as folder:
        wording = contract.about_ambient()
        texts = [wording.instruction, *wording.questions]
        random_vlm.write(Path(folder), texts, SIZES, "bfloat16")
        vlm = load_vlm(VlmSettings(model=folder, threads=threads, image_tokens=256))
    _pass(vlm, pictures[0])
    print("burning", flush=True)
    started = time.monotonic()
    used = time.process_time()
    passes = 0
    while time.monotonic() - started < seconds:
        _pass(vlm, pictures[passes % len(pictures)])
        passes += 1
    wall = time.monotonic() - started
    return {
        "model": "random weights",
        "passes": passes,
        "seconds": round(wall, 2),
        "cores": round((time.process_time() - used) / wall, 2),
    }


def _pass(vlm: Vlm, picture: Picture) -> None:
    with suppress(VlmError):  # random weights favour no number
        vlm.ambient(picture)


if __name__ == "__main__":
    seconds = float(sys.argv[1])
    threads = int(sys.argv[2])
    if hasattr(os, "nice"):
        os.nice(NICE)
    prepare_process(threads)
    print(json.dumps(burn(seconds, threads)))
