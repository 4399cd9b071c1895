"""Qwen2-VL-2B at full size with random weights: seconds and memory, and no answer that counts.

`python -m hapticvlm_lab.bench.ambient.full_size` builds the published architecture, times reading
and writing an answer at 64, 128 and 256 image tokens, and sets them beside what the machine's
bandwidth and matrix products allow. Needs about 6 GB. `--device cuda` has not been run on a GPU.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import resource
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from hapticvlm.recognition.vlm.local import prepare_process

if TYPE_CHECKING:
    from hapticvlm_lab.bench.ambient.speed import Timing

TOKENS = (64, 128, 256)
MOST_TURNS = 5
READ_BYTES = 1 << 30  # for the bandwidth: far more than any cache
SIDE = 2048  # of the matrices for the peak


def main(arguments: Sequence[str] | None = None) -> None:
    """Build, time and print; the last line is one JSON document."""
    given = _parse(arguments)
    prepare_process(given.threads)
    import torch

    torch.set_num_threads(given.threads)
    network, tokenizer = _build(given)
    found = {}
    for tokens in given.tokens:
        found[tokens] = _time(network, tokenizer, tokens, given.most_s / len(given.tokens))
    memory = _peak_memory(given.device)
    roof = _roofline(network.model, given.device)
    for name, value in roof.items():
        print(f"{name:<26}{value:>9.3g}")
    print(json.dumps({**_report(given), **memory, **_figures(found), "roofline": roof}))


def _parse(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--device", choices=("cpu", "cuda"), default="cpu")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--precision", choices=("bfloat16", "float32"), default="bfloat16")
    parser.add_argument("--tokens", type=int, nargs="+", default=list(TOKENS))
    parser.add_argument("--most-s", type=float, default=300.0, help="for all timings together")
    parser.add_argument("--tiny", action="store_true", help="a model of 0.2 M, to try this out")
    return parser.parse_args(arguments)


def _build(given: argparse.Namespace) -> tuple[Any, Any]:
    from hapticvlm.recognition.vlm import contract
    from hapticvlm.recognition.vlm.network import Network
    from hapticvlm_lab.bench.ambient import random_model

    start = time.perf_counter()
    asked = contract.about_ambient(contract.MOST_WORDINGS)
    tokenizer = random_model.stand_in_tokenizer([" ".join((asked.instruction, *asked.questions))])
    sizes = random_model.TINY if given.tiny else random_model.FULL
    configuration = random_model.config(sizes, tokenizer)
    model = random_model.random_network(configuration, given.precision).to(given.device)
    count = sum(weight.numel() for weight in model.parameters())
    took = time.perf_counter() - start
    print(f"random weights, so times only: {count / 1e9:.2f} G parameters, built in {took:.0f} s")
    return Network(model), tokenizer


def _time(network: Any, tokenizer: Any, tokens: int, most_s: float) -> dict[str, Timing]:  # noqa: ANN401
    from hapticvlm.recognition.vlm.chat import Chat
    from hapticvlm_lab.bench.ambient import random_model, speed

    images = random_model.image_processor(tokens)
    chat = Chat(tokenizer, images, None, network.model.config.image_token_id)
    picture = speed.picture(*speed.shape_for(tokens))
    timings = speed.time_in_turn(speed.methods(network, chat, picture), MOST_TURNS, most_s)
    speed.print_table(tokens, timings)
    return timings


def _roofline(model: Any, device: str) -> dict[str, float]:  # noqa: ANN401 - of transformers
    """Measure bandwidth and peak, and what they allow for one written token, from its weights."""
    import torch

    block = torch.ones(READ_BYTES // 4, dtype=torch.float32, device=device)
    square = torch.ones(SIDE, SIDE, dtype=model.dtype, device=device)
    read_s = _least(block.sum, device)
    product_s = _least(lambda: square @ square, device)
    held = sum(w.numel() * w.element_size() for w in model.model.language_model.parameters())
    bandwidth = READ_BYTES / read_s
    return {
        "bandwidth, GB/s": bandwidth / 1e9,
        "matrix product, GFLOP/s": 2 * SIDE**3 / product_s / 1e9,
        "text weights, GB": held / 1e9,
        "least a token, s": held / bandwidth,
    }


def _least(work: Callable[[], object], device: str) -> float:
    import torch

    times = []
    for _ in range(8):
        start = time.perf_counter()
        work()
        if device == "cuda":
            torch.cuda.synchronize()
        times.append(time.perf_counter() - start)
    return min(times)


def _peak_memory(device: str) -> dict[str, int | None]:
    """Print and return the most memory held so far, by the process and on the GPU."""
    import torch

    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    gpu = torch.cuda.max_memory_allocated() if device == "cuda" else None
    gpu_text = "" if gpu is None else f", {gpu / 1e9:.2f} GB of the GPU"
    print(f"\npeak memory {peak / 1e9:.2f} GB{gpu_text}; load {os.getloadavg()[0]:.1f}")
    return {"peak_bytes": peak, "gpu_peak_bytes": gpu}


def _report(given: argparse.Namespace) -> dict[str, Any]:
    import torch
    import transformers

    on_gpu = given.device == "cuda"
    return {
        "what": "Qwen2-VL tiny" if given.tiny else "Qwen2-VL-2B",
        "weights": "random",
        "device": torch.cuda.get_device_name() if on_gpu else platform.machine(),
        "threads": given.threads,
        "precision": given.precision,
        "torch": torch.__version__,
        "transformers": transformers.__version__,
        "load": round(os.getloadavg()[0], 1),
    }


def _figures(found: dict[int, dict[str, Timing]]) -> dict[str, Any]:
    from hapticvlm_lab.bench.ambient.speed import ratios, share_saved

    return {
        "seconds": {
            tokens: {name: asdict(timing) for name, timing in timings.items()}
            for tokens, timings in found.items()
        },
        "times_faster": {tokens: ratios(timings) for tokens, timings in found.items()},
        "times_faster_cores": {tokens: ratios(t, "cores") for tokens, t in found.items()},
        "head_saves": {tokens: share_saved(timings) for tokens, timings in found.items()},
        "head_saves_cores": {tokens: share_saved(t, "cores") for tokens, t in found.items()},
    }


if __name__ == "__main__":
    main()
