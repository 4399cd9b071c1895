"""What one method costs, each in a process of its own: seconds an answer, seconds to load, memory.

So the peak is that of the method alone, and one that is ended for want of memory ends nothing else.
"""

from __future__ import annotations

import http.server
import json
import multiprocessing
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from hapticvlm.evidence.reading import Reading
from hapticvlm.vlm.contract import Picture, Vlm, VlmError
from hapticvlm_lab.bench.ambient.methods import REPLY, Method
from hapticvlm_studio.evaluation.asking import guess_of
from hapticvlm_studio.evaluation.scores import Guess


@dataclass(frozen=True, slots=True)
class Timed:
    """Of n answers in turn: median and longest seconds; seconds to load; peak memory in MB.

    guesses: one a picture, None where there was none. Refusals are timed like answers, for a
    random model's sentences hold no number. The first answer, which warms up, is not timed; an
    endpoint must give it.
    """

    n: int
    median_s: float
    longest_s: float
    load_s: float
    peak_mb: float | None
    guesses: tuple[Guess | None, ...]


def measure(method: Method, pictures: Sequence[Picture]) -> Timed | str:
    """Ask about pictures (H, W, 3) uint8 in a new process; return why if that is not possible."""
    context = multiprocessing.get_context("spawn")
    try:
        with ProcessPoolExecutor(1, mp_context=context) as pool, _placed(method) as placed:
            return pool.submit(_measure, placed, list(pictures)).result()
    except VlmError as error:
        return str(error)
    except BrokenProcessPool:
        return "its process was ended, for want of memory most likely"


def _measure(method: Method, pictures: Sequence[Picture]) -> Timed:
    started = time.monotonic()
    vlm = _loaded(method)
    load_s = time.monotonic() - started
    vlm.ambient(pictures[0]) if vlm.is_remote else _ask(vlm, pictures[0])
    times: list[float] = []
    guesses: list[Guess | None] = []
    for picture in pictures:
        started = time.monotonic()
        reading = _ask(vlm, picture)
        times.append(time.monotonic() - started)
        guesses.append(None if reading is None else guess_of(reading))
    vlm.close()
    figures = float(np.median(times)), max(times), load_s, _peak_mb()
    return Timed(len(times), *figures, tuple(guesses))


def _loaded(method: Method) -> Vlm:
    from hapticvlm.vlm.local import load_local, load_vlm, prepare_process

    if method.family not in ("readout", "generation"):
        return load_vlm(method.settings)
    prepare_process(method.settings.threads)
    vlm = load_local(method.settings, method.precision)
    if method.family == "readout":
        return vlm
    from hapticvlm_lab.bench.ambient.writing import WritingVlm

    return WritingVlm(vlm)


def _ask(vlm: Vlm, picture: Picture) -> Reading | None:
    try:
        return vlm.ambient(picture)
    except VlmError:
        return None


def _peak_mb() -> float | None:
    """Peak memory of this process, MB; None where the system does not say."""
    status = Path("/proc/self/status")
    if status.is_file():
        words = status.read_text(encoding="ascii").split("VmHWM:")[1].split()
        return int(words[0]) / 1024
    if sys.platform == "win32":
        return None
    import resource

    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / (1 << 20 if sys.platform == "darwin" else 1 << 10)


@contextmanager
def _placed(method: Method) -> Iterator[Method]:
    """Run for the wire's method an endpoint that answers at once, as long as it is asked."""
    if method.family != "wire":
        yield method
        return
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), _StandIn)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        url = f"http://127.0.0.1:{server.server_address[1]}"
        yield replace(method, settings=replace(method.settings, url=url))
    finally:
        server.shutdown()
        server.server_close()


class _StandIn(http.server.BaseHTTPRequestHandler):
    """Answers every question with REPLY, whatever the picture."""

    def do_POST(self) -> None:
        self.rfile.read(int(self.headers["Content-Length"]))
        choice = {"message": {"content": REPLY}, "finish_reason": "stop"}
        answer = json.dumps({"choices": [choice]}).encode()
        self.send_response(200)
        self.send_header("Content-Length", str(len(answer)))
        self.end_headers()
        self.wfile.write(answer)

    def log_message(self, *_: object) -> None:
        """Keep quiet."""
