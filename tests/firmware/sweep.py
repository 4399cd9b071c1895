"""Every fault alone in every situation, and in pairs: `python tests/firmware/sweep.py --pairs`.

Prints a table and, as its last line, one JSON document. A worker per process; the result does not
depend on their number. Ends with 1 when a trial left the skin's limits.
"""

from __future__ import annotations

import argparse
import itertools
import json
import multiprocessing
import sys
import tempfile
from collections import Counter
from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path

if __package__ in (None, ""):
    sys.path.insert(0, str(Path(__file__).parents[1]))

from firmware import build, tracking
from firmware.build import Chip
from firmware.faults import BY_NAME, FAULTS, Fault
from firmware.situations import COLD, HOT, SITUATIONS, Situation
from firmware.trials import LONG_S, Outcome, trial

PAIR_S = 120.0  # longest trial of a pair

Job = tuple[tuple[str, ...], Situation]
_chip: Chip | None = None


def main() -> int:
    """Run what was asked for; 0 when all was safe."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pairs", action="store_true", help="pairs too (half an hour)")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--only", default="", help="faults whose name has this in it")
    asked = parser.parse_args()
    if reason := build.missing():
        sys.exit(reason)
    with tempfile.TemporaryDirectory() as folder:
        build.build(Path(folder))
        with multiprocessing.Pool(asked.jobs, _open, (folder,)) as pool:
            outcomes = list(_told(pool.imap(_try, jobs(asked.only, pairs=asked.pairs))))
            touches = list(pool.imap(_touch, _touches()))
    _print_tracking(touches)
    print(json.dumps(_summary(outcomes, touches)))
    return 0 if all(outcome.is_safe for outcome in outcomes) else 1


def jobs(only: str = "", *, pairs: bool) -> list[Job]:
    """Return every trial there is to run."""
    named = [fault for fault in FAULTS if only in fault.name]
    alone = [(fault.name,) for fault in named]
    both = [(one.name, two.name) for one, two in itertools.combinations(named, 2)] if pairs else []
    singles = [(names, situation) for names in alone for situation in SITUATIONS]
    return singles + [(names, situation) for names in both for situation in (HOT, COLD)]


def _open(folder: str) -> None:
    global _chip
    _chip = build.opened(Path(folder))


def _try(job: Job) -> Outcome:
    names, situation = job
    if _chip is None:
        raise RuntimeError("no chip in this process")
    faults: list[Fault] = [BY_NAME[name] for name in names]
    return trial(_chip.board, faults, situation, LONG_S if len(faults) == 1 else PAIR_S)


def _touches() -> list[tuple[str, float, bool]]:
    return list(itertools.product(tracking.MATERIALS, tracking.AMBIENTS_C, (True, False)))


def _touch(case: tuple[str, float, bool]) -> tracking.Tracking:
    material, ambient_c, approached = case
    if _chip is None:
        raise RuntimeError("no chip in this process")
    return tracking.touch(_chip, material, ambient_c, approached=approached)


def _told(outcomes: Iterable[Outcome]) -> Iterable[Outcome]:
    print(f"{'fault':46s} {'situation':16s}   off/s  left/s   cut/s  skin/degC    CEM43  caught by")
    for outcome in outcomes:
        times = (outcome.off_after_s, outcome.left_after_s, outcome.cut_out_after_s)
        skin = f"{outcome.skin_low_c:5.1f}..{outcome.skin_high_c:4.1f}"
        caught = ", ".join((*outcome.caught_by, *outcome.numbers)) or "nothing"
        print(
            f"{' + '.join(outcome.faults):46s} {outcome.situation:16s}",
            *(f"{'-':>7s}" if time is None else f"{time:7.3f}" for time in times),
            f"{skin} {outcome.dose_cem43:7.3f}  {caught}{'' if outcome.is_safe else '  UNSAFE'}",
            flush=True,
        )
        yield outcome


def _print_tracking(touches: list[tracking.Tracking]) -> None:
    print("\nmaterial  room  approached  limited  unlimited  first second: plate  skin  (RMS/degC)")
    for touch in touches:
        print(
            f"{touch.material:9s} {touch.ambient_c:4.0f}  {touch.approached!s:10s} ",
            f"{touch.limited_rms_c:7.3f} {touch.unlimited_rms_c:10.3f} {touch.first_rms_c:20.2f}",
            f"{touch.first_skin_rms_c:5.2f}  {', '.join(touch.limited_by)}",
        )


def _summary(outcomes: list[Outcome], touches: list[tracking.Tracking]) -> dict[str, object]:
    needs_cut_out = {
        " + ".join(outcome.faults) for outcome in outcomes if outcome.cut_out_after_s is not None
    }
    return {
        "trials": len(outcomes),
        "unsafe": [asdict(outcome) for outcome in outcomes if not outcome.is_safe],
        "hottest": asdict(max(outcomes, key=lambda outcome: outcome.skin_high_c)),
        "coldest": asdict(min(outcomes, key=lambda outcome: outcome.skin_low_c)),
        "highest_dose": asdict(max(outcomes, key=lambda outcome: outcome.dose_cem43)),
        "cut_out_opened": sorted(needs_cut_out),
        "caught_by": Counter(" and ".join(outcome.caught_by) for outcome in outcomes),
        "alone": [asdict(outcome) for outcome in outcomes if len(outcome.faults) == 1],
        "tracking": [asdict(touch) for touch in touches],
    }


if __name__ == "__main__":
    sys.exit(main())
