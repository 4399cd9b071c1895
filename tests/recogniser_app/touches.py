"""Touches beside a shared recogniser that misbehaves.

`PYTHONPATH=tests/support python tests/recogniser_app/touches.py`: one scene sends 10 frames/s and
touches, a bare echo of the same bytes takes turns with it. A row for each fault, with the
deadline that ships; ratios are to the echo. No Ray: the faults are those of
tests/support/shared_recogniser.py, in a process of its own.
"""

from __future__ import annotations

import argparse
import asyncio
import multiprocessing
from multiprocessing.connection import Connection

from shared_recogniser import shared_recogniser

from hapticvlm.client.local_service import Service, running
from hapticvlm_lab.bench.latency import touch
from hapticvlm_lab.bench.latency.round_trip import echo
from hapticvlm_lab.bench.rigs import priority

FAULTS = ("answers", "hangs", "garbage", "wrong hash", "fails", "closes")
FRAMES = (1, 10.0)  # scenes, frames/s of each


def main() -> None:
    """Measure and print a row a fault."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=15.0, help="per row (%(default)s)")
    seconds = parser.parse_args().seconds
    ours, theirs = multiprocessing.Pipe()
    process = multiprocessing.get_context("spawn").Process(target=_share, args=(theirs,))
    process.start()
    try:
        with priority(True), echo(True) as port:
            with running() as service:
                _row("embedded", service, port, seconds)
            with running(["--recogniser-url", ours.recv()]) as service:
                for fault in FAULTS:
                    ours.send(fault)
                    _row(fault, service, port, seconds)
    finally:
        process.terminate()


def _share(pipe: Connection) -> None:
    with shared_recogniser() as shared:
        pipe.send(shared.url)
        while True:
            shared.fault = pipe.recv()


def _row(name: str, service: Service, port: int, seconds: float) -> None:
    found = asyncio.run(touch.measured(name, service, port, seconds, FRAMES)).summary()
    frames = found["frames"]
    print(
        f"{name:<11} touch {found['touch_median_ms']:.2f} / {found['touch_p99_ms']:.2f} ms, "
        f"echo {found['echo_median_ms']:.2f} / {found['echo_p99_ms']:.2f}, "
        f"ratio {found['median_ratio']} / {found['p99_ratio']}, n {found['n']}; "
        f"frames {frames['sent']}, unanswered {frames['unanswered']}, "
        f"age {frames['age_ms']['median']:.0f} / {frames['age_ms']['p99']:.0f} ms",
        flush=True,
    )


if __name__ == "__main__":
    main()
