"""`hapticvlm calibrate speaker --by-hand`: measures what a hand feels of its speaker, by asking.

Each trial has two moments of half a second, and one of them vibrates. The result corrects speaker
and hand together and needs no accelerometer.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from typing import TYPE_CHECKING

from hapticvlm.errors import UsageError, shell_word, usage_errors

if TYPE_CHECKING:
    from hapticvlm_studio.calibration.hand_threshold import Answer, ThresholdEstimator

WIDE_DB = 15.0  # of an interval: wider than the largest correction, it decides nothing
# (index of the frequency, dB, first moment vibrates) -> answer, or None to stop
Ask = Callable[[int, float, bool], "Answer | None"]


def run(options: argparse.Namespace) -> int:
    """Ask a person, or a simulated hand, and write the curve. Raises UsageError, OutputError."""
    from hapticvlm_studio.calibration.hand_threshold import ThresholdEstimator

    estimator = ThresholdEstimator()
    with usage_errors():
        try:
            with _answers(options) as ask:
                _run(estimator, ask, options)
        except EOFError:
            raise UsageError("no more answers: nothing was calibrated") from None
        return _report(estimator, options)


@contextmanager
def _answers(options: argparse.Namespace) -> Iterator[Ask]:
    """Yield a function that answers a trial: a simulated hand, or a person at a speaker."""
    from hapticvlm_studio.calibration import hand_threshold as threshold

    if options.simulate:
        simulated = threshold.SimulatedHand(threshold.SIMULATED_THRESHOLDS_DB)
        yield lambda index, level_db, _: simulated.answer(index, level_db)
        return
    from hapticvlm_studio.calibration import output

    with output.open_player(options.speaker) as player:

        def ask(index: int, level_db: float, is_first: bool) -> Answer | None:
            frequency_hz = threshold.FREQUENCIES_HZ[index]
            player.play(threshold.moments(frequency_hz, level_db, is_first=is_first))
            return _person(is_first=is_first)

        print(f"{player.name}: rest your palm on it; press Enter to begin", file=sys.stderr)
        _read("")
        yield ask


def _person(*, is_first: bool) -> Answer | None:
    """Ask until one of the four answers is given. Raises EOFError."""
    while True:
        key = _read("  which moment vibrated, 1 or 2, or 0 for neither (q to stop)? ")
        if key == "q":
            return None
        if key == "0":
            return "neither"
        if key in ("1", "2"):
            return "right" if (key == "1") == is_first else "wrong"


def _read(question: str) -> str:
    """Ask on standard error, so that standard output holds only JSON. Raises EOFError."""
    print(question, end="", file=sys.stderr, flush=True)
    return input().strip().lower()


def _run(estimator: ThresholdEstimator, ask: Ask, options: argparse.Namespace) -> None:
    """Run the trials, or as many as are answered."""
    from hapticvlm_studio.calibration import hand_threshold as threshold

    order = threshold.trial_order(threshold.TRIALS, seed=0)
    for number, (index, is_first) in enumerate(order, 1):
        level_db = estimator.next_level_db(index)
        if not options.simulate:
            print(f"trial {number} of {len(order)}", file=sys.stderr, flush=True)
        answer = ask(index, level_db, is_first)
        if answer is None:
            return
        estimator.learn(index, level_db, answer)


def _report(estimator: ThresholdEstimator, options: argparse.Namespace) -> int:
    from hapticvlm.devices.speaker.speaker_files import write_response
    from hapticvlm_studio.calibration.hand_threshold import as_response

    estimates = estimator.estimates()
    if not all(estimate.trials for estimate in estimates):
        raise UsageError("too few answers: each frequency needs at least one")
    simulated = options.simulate or options.speaker == "simulated"
    response = as_response(estimates, simulated=simulated)
    if options.out is not None:
        write_response(options.out, response)
    if options.json:
        result = {"calibrate": "hand", "simulated": simulated}
        print(json.dumps({**result, "thresholds": [asdict(estimate) for estimate in estimates]}))
        return 0
    if simulated:
        print("simulated: this curve is only a rehearsal, do not use it")
    gains_db = response.correction().gain_db
    print(f"{'Hz':>6} {'threshold, dB of full scale':>28} {'95 %':>14} {'correction, dB':>16}")
    for estimate, gain_db in zip(estimates, gains_db, strict=True):
        interval = f"{estimate.low_db:.0f} to {estimate.high_db:.0f}"
        threshold = f"{estimate.frequency_hz:>6.0f} {estimate.threshold_db:>28.1f}"
        print(f"{threshold} {interval:>14} {gain_db:>16.1f}")
    widest = max(estimates, key=lambda estimate: estimate.high_db - estimate.low_db)
    if widest.high_db - widest.low_db > WIDE_DB:
        print(f"still uncertain, most at {widest.frequency_hz:.0f} Hz: measure it again")
    if options.out is not None:
        print(f"to use it: hapticvlm serve --speaker-response {shell_word(options.out)}")
    return 0
