"""Fuzz: `python tests/fuzz/run.py [TARGET ...] [--seconds S | --count N] [--seed N]`.

Starts from the corpus, keeps what ends in a finding under tests/fuzz/found/, and says how many
inputs each target took. Deterministic for a seed and a count.
"""

from __future__ import annotations

import argparse
import logging
import random
import sys
import tempfile
import time
import traceback
from pathlib import Path

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE.parent / "support")]

from targets import TARGETS  # noqa: E402

CORPUS, FOUND = HERE / "corpus", HERE / "found"
MEMORY = Path("/dev/shm")  # a disk takes 3 ms to begin a file anew, more than any target
MOST_BYTES = 64 * 1024
WORDS = (
    b"nan",
    b"1e999",
    b"-0",
    b"[" * 3000,
    b"{" * 3000,
    b"a." * 400,
    b"null",
    b"\xff\xff\xff\xff",
)
MORE = (b"9" * 5000, b"\0" * 16, b'"x"', b"true", b"]", b"}", b"\xc1", b"\xdd\xff\xff\xff\xff")


def seeds(name: str) -> list[bytes]:
    """Return the kept inputs of a target, the smallest first."""
    files = sorted((CORPUS / name).iterdir(), key=lambda path: (path.stat().st_size, path.name))
    return [path.read_bytes() for path in files]


def mutated(rng: random.Random, corpus: list[bytes]) -> bytes:
    """Return one kept input with a few wounds, or two of them crossed."""
    data = bytearray(rng.choice(corpus))
    for _ in range(rng.choice((1, 1, 2, 4, 16))):
        at = rng.randrange(len(data) + 1)
        match rng.randrange(7):
            case 0 if data:
                data[at - 1] ^= 1 << rng.randrange(8)
            case 1 if data:
                data[at - 1] = rng.randrange(256)
            case 2:
                del data[at : at + rng.choice((1, 2, 8, 64))]
            case 3:
                data[at:at] = rng.choice(WORDS + MORE)
            case 4:
                data[at:at] = data[at : at + rng.randrange(64)]
            case 5:
                other = rng.choice(corpus)
                data[at:] = other[rng.randrange(len(other) + 1) :]
            case _:
                data[at:at] = rng.randbytes(rng.randrange(8))
    return bytes(data[:MOST_BYTES])


def fuzz(name: str, *, seed: int, seconds: float, count: int) -> tuple[int, int, list[str]]:
    """Run one target for so long, or so many inputs.

    Returns how many, of how many bytes together, and what was found.
    """
    rng, corpus, found = random.Random(f"{name} {seed}"), seeds(name), []
    until, done, size = time.monotonic() + seconds, 0, 0
    with tempfile.TemporaryDirectory(dir=MEMORY if MEMORY.is_dir() else None) as scratch:
        file = Path(scratch) / "input"
        for done in range(1, count + 1):
            data = corpus[done - 1] if done <= len(corpus) else mutated(rng, corpus)
            size += len(data)
            try:
                TARGETS[name].run(data, file)
            except Exception:  # noqa: BLE001 - any undeclared error is what is looked for
                FOUND.mkdir(exist_ok=True)
                kept = FOUND / f"{name}-{seed}-{done}"
                kept.write_bytes(data)
                found.append(f"{kept.name}: {traceback.format_exc(limit=-3)[:900]}")
                if len(found) >= 5:
                    break
            if time.monotonic() > until:
                break
    return done, size, found


def main() -> int:
    """Run the targets named, or all."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("targets", nargs="*", default=list(TARGETS))
    parser.add_argument("--seconds", type=float, default=float("inf"))
    parser.add_argument("--count", type=int, help="inputs of each target (its own goal)")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    failed = 0
    logging.disable()
    for name in options.targets:
        count = options.count or TARGETS[name].goal
        started = time.monotonic()
        done, size, found = fuzz(name, seed=options.seed, seconds=options.seconds, count=count)
        took = f"{done} inputs, {size / 1e6:.1f} MB, {time.monotonic() - started:.0f} s"
        print(f"{name}: {took}, {len(found)} findings", flush=True)
        print("".join(found), end="", flush=True)
        failed += bool(found)
    return failed


if __name__ == "__main__":
    sys.exit(main())
