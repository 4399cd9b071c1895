"""`hapticvlm calibrate hand`: find what a hand feels of its speaker by asking, with no sensor."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from hapticvlm.commands.parsing import add_json
from hapticvlm.errors import UsageError, usage_errors

if TYPE_CHECKING:
    from hapticvlm.commands.parsing import Commands
    from hapticvlm_studio.calibration.hand_threshold import Answer, Hand

WIDE_DB = 15.0  # of an interval: more than what is corrected either way tells nothing
Ask = Callable[[int, float, bool], "Answer | None"]  # which frequency, dB, first; None: no more

_DESCRIPTION = """
Find the weakest vibration that a hand feels on its speaker, at four frequencies. Each trial has two
moments of half a second, and one of them vibrates: say 1 or 2, or 0 if you felt neither. Rest the
palm on the speaker as you will use it, and wear headphones with noise: what is heard must not help.
Forty-eight trials take about three minutes; q stops earlier. The result corrects speaker and hand
together, with no accelerometer. With --simulate a simulated hand answers.
"""


def add(subjects: Commands) -> None:
    """Declare `calibrate hand`."""
    hand = subjects.add_parser(
        "hand",
        help="measure what a hand feels of its speaker",
        description=_DESCRIPTION,
        examples=(
            "hapticvlm calibrate hand --speaker default --out hand.toml",
            "hapticvlm calibrate hand --simulate",
        ),
    )
    hand.set_defaults(run=_hand)
    source = hand.add_mutually_exclusive_group(required=True)
    source.add_argument(
        "--speaker", metavar="NAME", help="the speaker: `default`, `jack`, or part of its name"
    )
    source.add_argument("--simulate", action="store_true", help="let a simulated hand answer")
    hand.add_argument(
        "--trials", type=_trials, default=12, metavar="N", help="at each frequency (%(default)s)"
    )
    hand.add_argument(
        "--seed", type=int, default=0, metavar="N", help="seed of the order (%(default)s)"
    )
    add_json(hand)
    hand.add_argument(
        "--out",
        type=Path,
        metavar="FILE",
        help="write the result here, for `hapticvlm serve --speaker-response FILE`",
    )


def _trials(text: str) -> int:
    value = int(text)
    if not 1 <= value <= 50:
        raise argparse.ArgumentTypeError(f"{text} is not within 1..50")
    return value


def _hand(options: argparse.Namespace) -> int:
    from hapticvlm_studio.calibration.hand_threshold import Hand

    hand = Hand()
    with usage_errors():
        try:
            with _answers(options) as ask:
                _run(hand, ask, options)
        except EOFError:
            raise UsageError("no more answers: the calibration is not finished") from None
        return _report(hand, options)


@contextmanager
def _answers(options: argparse.Namespace) -> Iterator[Ask]:
    """Offer who answers: a simulated hand, or a person at a speaker."""
    from hapticvlm_studio.calibration import hand_threshold as threshold

    if options.simulate:
        simulated = threshold.SimulatedHand(threshold.REHEARSED_DB, seed=options.seed)
        yield lambda which, level_db, _: simulated.answer(which, level_db)
        return
    from hapticvlm_studio.calibration import output

    with output.opened(options.speaker) as sounding:

        def ask(which: int, level_db: float, is_first: bool) -> Answer | None:
            hertz = threshold.FREQUENCIES_HZ[which]
            sounding.play(threshold.moments(hertz, level_db, is_first=is_first))
            return _person(is_first=is_first)

        print(f"{sounding.name}: rest your palm on it; trials begin with Enter", file=sys.stderr)
        _read("")
        yield ask


def _person(*, is_first: bool) -> Answer | None:
    while True:
        said = _read("  which moment vibrated, 1 or 2, or 0 for neither (q to stop)? ")
        if said == "q":
            return None
        if said == "0":
            return "neither"
        if said in ("1", "2"):
            return "right" if (said == "1") == is_first else "wrong"


def _read(question: str) -> str:
    """Ask on stderr, so that --json has its output for itself. Raises EOFError."""
    print(question, end="", file=sys.stderr, flush=True)
    return input().strip().lower()


def _run(hand: Hand, ask: Ask, options: argparse.Namespace) -> None:
    """Run the trials; no answer ends them."""
    from hapticvlm_studio.calibration.hand_threshold import course

    planned = course(options.trials, options.seed)
    for number, (which, is_first) in enumerate(planned, 1):
        level_db = hand.next_level_db(which)
        if not options.simulate:
            print(f"trial {number} of {len(planned)}", file=sys.stderr, flush=True)
        answer = ask(which, level_db, is_first)
        if answer is None:
            return
        hand.learn(which, level_db, answer)


def _report(hand: Hand, options: argparse.Namespace) -> int:
    from hapticvlm.devices.speaker.speaker_files import write_response
    from hapticvlm_studio.calibration.hand_threshold import as_response

    found = hand.estimates()
    if not all(one.trials for one in found):
        raise UsageError("too few answers: each frequency needs at least one")
    simulated = options.simulate or options.speaker == "simulated"
    response = as_response(found, simulated=simulated)
    if options.out is not None:
        write_response(options.out, response)
    if options.json:
        result = {"calibrate": "hand", "simulated": simulated}
        print(json.dumps({**result, "thresholds": [asdict(one) for one in found]}))
        return 0
    if simulated:
        print("hand or speaker is simulated: the curve is a rehearsal, nobody's")
    gains_db = response.correction().gain_db
    print(f"{'Hz':>6} {'felt from, dB of full scale':>28} {'95 %':>14} {'corrected by dB':>16}")
    for one, by_db in zip(found, gains_db, strict=True):
        within = f"{one.low_db:.0f} to {one.high_db:.0f}"
        print(f"{one.frequency_hz:>6.0f} {one.threshold_db:>28.1f} {within:>14} {by_db:>16.1f}")
    widest = max(found, key=lambda one: one.high_db - one.low_db)
    if widest.high_db - widest.low_db > WIDE_DB:
        print(f"not sure yet, least at {widest.frequency_hz:.0f} Hz: ask more often, with --trials")
    if options.out is not None:
        print(f"use it: hapticvlm serve --speaker-response {options.out}")
    return 0
