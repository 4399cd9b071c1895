"""Tries every fault alone and in pairs: `python tests/firmware/sweep.py --pairs`.

Prints a table and, as its last line, one JSON document. A worker per process; the result does not
depend on their number. Every trial is saved when it ends, and a second call resumes where the
first one stopped. Pairs are shuffled with a fixed seed, so that a partial sweep has tried every
fault; the cool room comes first, where the cut-out has the least margin. A held plate costs a
minute a trial, so it meets every fault alone, but of the pairs only those with a shorted bridge:
the one fault that drives the plate past its guards from wherever it stands. Exits with 1 when a
trial left the skin's limits or failed.
"""

from __future__ import annotations

import argparse
import itertools
import json
import random
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import asdict
from functools import partial
from pathlib import Path

if __package__ in (None, ""):
    sys.path[:0] = [str(Path(__file__).parents[1]), str(Path(__file__).parents[1] / "support")]

from toolchains import missing

from firmware import build
from firmware.board import Build
from firmware.build import Chip
from firmware.checkpoint import Checkpoint, Failure, Key, Result, digest, key
from firmware.faults import BY_NAME, FAULTS, Fault
from firmware.situations import COLD, COLD_WARM, HELD, HOT, SITUATIONS, Situation
from firmware.trials import LONG_S, Outcome, trial
from hapticvlm.devices.simulated.plant import FACE_J_PER_K

PAIR_S = 120.0  # longest trial of a pair
KEPT = Path(__file__).parents[2] / ".work" / "firmware-sweep.jsonl"
SEED = 5
BATCH = 64

# Pairs that no guard covers. A welded cut-out and a transistor that does not let it go are reported
# at every start, before a hand is on the plate. A shorted R13 is found when the plate is built.
BEYOND = [
    {part, f"bridge shorted to {way}"}
    for part, ways in (
        ("cut-out welded", ("heat", "cool")),
        ("Q2 shorted", ("heat", "cool")),
        ("R13 shorted", ("heat",)),
    )
    for way in ways
]

NOT_IN_ONE_RESISTOR = {"D1 shorted", "D1 open", "R14 shorted", "U4 open or Q1 shorted"}  # parts
Job = tuple[tuple[str, ...], Situation]
Begin = Callable[[], None]  # opens the built parts in a new process
_chip: Chip | None = None
_build = Build()


def main() -> int:
    """Run the requested trials; return 0 when all were safe."""
    asked = _asked()
    if reason := missing("simavr", "make"):
        sys.exit(reason)
    ends_at = time.monotonic() + asked.minutes * 60.0
    wanted = jobs(asked.only, pairs=asked.pairs, has_one_resistor=asked.one_resistor)
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        build.build(folder)
        tried = Build(asked.lag, asked.face, has_one_resistor=asked.one_resistor)
        begin = partial(_open, folder, tried)
        kept = Checkpoint(asked.keep, f"{digest(folder / 'firmware' / 'plate.hex')} {tried}")
        known = {key(outcome): outcome for outcome in kept.outcomes()}
        found: dict[Key, Result] = {
            _key(job): known[_key(job)] for job in wanted if _key(job) in known
        }
        left = [job for job in wanted if _key(job) not in known]
        print(f"{len(found)} of {len(wanted)} trials were made before")
        for result in _told(_run(begin, left, asked.jobs, ends_at)):
            kept.keep(result)
            found[key(result)] = result
    print(json.dumps(_summary(list(found.values()), len(wanted))))
    return 0 if all(result.is_safe for result in found.values()) else 1


def _asked() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--pairs", action="store_true", help="pairs too (an hour or two)")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--only", default="", help="faults whose name has this in it")
    parser.add_argument("--lag", type=float, default=0.0, help="of the plate's beads, s")
    parser.add_argument("--face", type=float, default=FACE_J_PER_K, help="heat capacity, J/K")
    parser.add_argument("--one-resistor", action="store_true", help="the plate of one resistor")
    parser.add_argument("--minutes", type=float, default=1e6, help="begin no trial after that long")
    parser.add_argument("--keep", type=Path, default=KEPT, help="what was tried (%(default)s)")
    return parser.parse_args()


def jobs(only: str = "", *, pairs: bool, has_one_resistor: bool = False) -> list[Job]:
    """Return all trials in order."""
    named = [fault.name for fault in FAULTS if only in fault.name]
    if has_one_resistor:
        named = [name for name in named if name not in NOT_IN_ONE_RESISTOR]
    singles = [((name,), situation) for name in named for situation in SITUATIONS]
    both = [pair for pair in itertools.combinations(named, 2) if set(pair) not in BEYOND]
    both = both if pairs else []
    random.Random(SEED).shuffle(both)
    shorted = [pair for pair in both if any(name.startswith("bridge shorted") for name in pair)]
    return [
        *((names, situation) for situation in (COLD, HOT, COLD_WARM) for names in both),
        *((names, situation) for situation in HELD for names in shorted),
        *singles,
    ]


def _key(job: Job) -> Key:
    return job[0], job[1].name


def _run(begin: Begin, left: list[Job], workers: int, ends_at: float) -> Iterator[Result]:
    for start in range(0, len(left), BATCH):
        if time.monotonic() > ends_at:
            return
        yield from _batch(begin, left[start : start + BATCH], workers)


def _batch(begin: Begin, batch: list[Job], workers: int) -> Iterator[Result]:
    """Run some jobs; jobs lost with a dead process are tried again, one by one."""
    lost = []
    with ProcessPoolExecutor(workers, initializer=begin) as pool:
        for job, future in [(job, pool.submit(_try, job)) for job in batch]:
            try:
                yield future.result()
            except BrokenProcessPool:
                lost.append(job)
    for job in lost:
        if len(batch) > 1:
            yield from _batch(begin, [job], 1)
        else:
            yield Failure(job[0], job[1].name, "its process died")


def _open(folder: Path, tried: Build) -> None:
    global _chip, _build
    _chip, _build = build.opened(folder), tried


def _try(job: Job) -> Result:
    names, situation = job
    faults: list[Fault] = [BY_NAME[name] for name in names]
    try:
        return trial(_opened(), faults, situation, LONG_S if len(faults) == 1 else PAIR_S, _build)
    except Exception as error:  # noqa: BLE001 - one trial that breaks must not end the sweep
        return Failure(names, situation.name, repr(error))


def _opened() -> Chip:
    if _chip is None:
        raise RuntimeError("no chip in this process")
    return _chip


def _told(results: Iterable[Result]) -> Iterator[Result]:
    print(f"{'fault':46s} {'situation':16s}   off/s  left/s   cut/s  skin/degC    CEM43  caught by")
    for result in results:
        print(_row(result), flush=True)
        yield result


def _row(result: Result) -> str:
    what = f"{' + '.join(result.faults):46s} {result.situation:16s}"
    if isinstance(result, Failure):
        return f"{what} FAILED {result.reason}"
    times = (result.off_after_s, result.left_after_s, result.cut_out_after_s)
    when = " ".join(f"{'-':>7s}" if time is None else f"{time:7.3f}" for time in times)
    skin = f"{result.skin_low_c:5.1f}..{result.skin_high_c:4.1f} {result.dose_cem43:7.3f}"
    caught = ", ".join((*result.caught_by, *result.numbers)) or "nothing"
    return f"{what} {when} {skin}  {caught}{'' if result.is_safe else '  UNSAFE'}"


def _summary(results: list[Result], wanted: int) -> dict[str, object]:
    outcomes = [result for result in results if isinstance(result, Outcome)]
    cut_out = [outcome for outcome in outcomes if outcome.cut_out_after_s is not None]
    return {
        "trials": len(outcomes),
        "of": wanted,
        "failed": [asdict(result) for result in results if isinstance(result, Failure)],
        "unsafe": [asdict(outcome) for outcome in outcomes if not outcome.is_safe],
        "hottest": asdict(max(outcomes, key=lambda outcome: outcome.skin_high_c)),
        "coldest": asdict(min(outcomes, key=lambda outcome: outcome.skin_low_c)),
        "highest_dose": asdict(max(outcomes, key=lambda outcome: outcome.dose_cem43)),
        "cut_out_opened": sorted({" + ".join(outcome.faults) for outcome in cut_out}),
        "caught_by": Counter(" and ".join(outcome.caught_by) for outcome in outcomes),
        "alone": [asdict(outcome) for outcome in outcomes if len(outcome.faults) == 1],
    }


if __name__ == "__main__":
    sys.exit(main())
