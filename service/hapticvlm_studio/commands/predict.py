"""`hapticvlm study predict` and `choose`: patterns judged by the machine observer, a model."""

from __future__ import annotations

import argparse
import json
import math
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hapticvlm.commands.parsing import add_json
from hapticvlm.errors import usage_errors

if TYPE_CHECKING:
    from hapticvlm.commands.parsing import Commands
    from hapticvlm_studio.observer.predict import PaperCheck, Prediction, Spread

SETS = ("ours", "twenty", "paper-like")
WHAT = "machine observer: a model, not people"
_PREDICT = """
Predict which patterns of a set are confused. The answers come from a machine observer of vibration
and heat, which is a model, not a person. It has two free numbers, its noise for vibration and for
heat. They are calibrated so that a set like the paper's gives the paper's figures: 84.67 % of
trials correct, and hot and cold confused in 4.2 %. The paper's stimuli are unpublished, so the
prediction is a range over guesses of them. Heat is what the simulated plate brings to the palm. The
random numbers are seeded. Exit code 2: the patterns cannot be read or presented.
"""
_CHOOSE = """
Search for strokes of the five vibrations that the machine observer confuses least; it is a model,
not a person. The search takes about half a minute. The shipped patterns were chosen this way, with
other seeds than those of the reported predictions.
"""


def add(parts: Commands) -> None:
    """Declare `hapticvlm study predict` and `hapticvlm study choose`."""
    predict = parts.add_parser(
        "predict",
        help="predict which patterns are confused, by a model",
        description=_PREDICT,
        examples=("hapticvlm study predict --patterns twenty --out prediction",),
    )
    predict.set_defaults(run=_predict)
    predict.add_argument(
        "--patterns",
        default="ours",
        metavar="FILE",
        help=f"TOML file with [[pattern]] tables, or {', '.join(SETS)} (%(default)s)",
    )
    predict.add_argument(
        "--noise",
        type=_noise,
        metavar="STEPS",
        help="noise of the observer in Weber steps (calibrated on the paper)",
    )
    predict.add_argument(
        "--heat-noise",
        type=_noise,
        metavar="STEPS",
        help="noise for heat in Weber steps (the same as --noise)",
    )
    predict.add_argument(
        "--guesses",
        type=_count,
        default=20,
        metavar="N",
        help="number of guesses of the paper's stimuli, each calibrated; 0: only the shipped one "
        "(%(default)s)",
    )
    predict.add_argument(
        "--out",
        type=Path,
        metavar="FOLDER",
        help="draw confusion matrices and curves into this folder",
    )
    add_json(predict)
    choose = parts.add_parser("choose", help="search for strokes that differ", description=_CHOOSE)
    choose.set_defaults(run=_choose)
    choose.add_argument(
        "--wider", action="store_true", help="also search among five more vibrations"
    )
    add_json(choose)


def _noise(text: str) -> float:
    value = float(text)
    if not (math.isfinite(value) and 0.0 <= value <= 1000.0):
        raise argparse.ArgumentTypeError(f"{text} is not within 0..1000")
    return value


def _count(text: str) -> int:
    value = int(text)
    if not 0 <= value <= 200:
        raise argparse.ArgumentTypeError(f"{text} is not within 0..200")
    return value


def _predict(options: argparse.Namespace) -> int:
    with usage_errors():
        _report(options)
    return 0


def _choose(options: argparse.Namespace) -> int:
    with usage_errors():
        _search(options)
    return 0


def _report(options: argparse.Namespace) -> None:
    from hapticvlm.commands.progress import working
    from hapticvlm_studio.design.patterns import named
    from hapticvlm_studio.observer import predict
    from hapticvlm_studio.observer.percepts import Noise

    stimuli = named(options.patterns)
    check = spread = None
    if options.noise is None and options.heat_noise is not None:
        raise ValueError("--heat-noise needs --noise")
    with working("running the machine observer"):
        if options.noise is None:
            check = predict.check(predict.paper_noise())
            noise = check.noise
            spread = predict.spread(stimuli, options.guesses) if options.guesses else None
        else:
            heat = options.noise if options.heat_noise is None else options.heat_noise
            noise = Noise(options.noise, heat)
        prediction = predict.predict(stimuli, noise)
        if options.out is not None:
            _draw(prediction, check, options)
    if options.json:
        print(json.dumps(_document(prediction, check, spread)))
        return
    _print(prediction, spread)
    if check is not None:
        _print_check(check)


def _draw(prediction: Prediction, check: PaperCheck | None, options: argparse.Namespace) -> None:
    from hapticvlm_studio.design import paper
    from hapticvlm_studio.design.patterns import named
    from hapticvlm_studio.observer import plots, predict

    folder: Path = options.out
    folder.mkdir(parents=True, exist_ok=True)
    name = Path(options.patterns).stem
    plots.draw_matrix(prediction, folder / f"observer-{name}.png")
    others = {
        other: predict.predict(named(other), prediction.noise).curve
        for other in SETS
        if other != options.patterns
    }
    plots.draw_curves({name: prediction.curve, **others}, folder / "observer-noise.png")
    if check is not None:
        path = folder / "observer-paper.png"
        plots.draw_check(check, paper.confusion(), paper.CODES, path)


def _document(
    prediction: Prediction, check: PaperCheck | None, spread: Spread | None
) -> dict[str, Any]:
    document = {"what": WHAT, **asdict(prediction), "counts": prediction.counts.tolist()}
    if spread is not None:
        document["guesses"] = asdict(spread)
    if check is not None:
        document["paper_check"] = {**asdict(check), "counts": check.counts.tolist()}
    return document


def _print(prediction: Prediction, spread: Spread | None) -> None:
    from hapticvlm_studio.observer.answers import TRIALS

    names = prediction.names
    noise = f"{prediction.noise.touch:.2f} (vibration) and {prediction.noise.heat:.2f} (heat)"
    print(f"{WHAT}; {TRIALS} trials per pattern at a noise of {noise} Weber steps")
    print(f"recognised: {prediction.recognised:.1%} of {len(names)} patterns{_range(spread)}")
    feature, share = prediction.one_feature
    print(
        f"  baselines: always the same answer {prediction.constant:.1%}, best single feature "
        f"{share:.1%}"
    )
    print(
        f"  ({feature}), vibration alone {prediction.touch_only:.1%}, heat alone "
        f"{prediction.heat_only:.1%}"
    )
    curve = ", ".join(f"x{factor:g} {share:.1%}" for factor, share in prediction.curve)
    print(f"  at other noise: {curve}")
    print("\nmost confused pairs (presented, answered, share of its trials):")
    for pair in prediction.pairs:
        print(f"  {pair.presented:<26} {pair.answered:<26} {pair.share:.1%}")
    if not prediction.pairs:
        print("  no pair in 0.5 % of trials or more")
    width = max(len(name) for name in names)
    print("\nconfusion matrix, % of a row's trials answered as each pattern, in the same order:")
    for name, row in zip(names, prediction.counts, strict=True):
        print(f"  {name:<{width}} " + " ".join(f"{100 * n / row.sum():3.0f}" for n in row))
    print("\nskin on the simulated plate, degC, as the first stroke begins and the last ends:")
    for name, (begin_c, end_c) in zip(names, prediction.palm_c, strict=True):
        print(f"  {name:<{width}} {begin_c:.1f} {end_c:.1f}")


def _range(spread: Spread | None) -> str:
    """Return how much the figure depends on the guess of the paper's stimuli, in words."""
    if spread is None:
        return ""
    return (
        f" with the shipped guess\n  of the paper's stimuli; with {spread.count} other guesses "
        f"{spread.lowest:.1%} to {spread.highest:.1%}, median {spread.median:.1%}, 80 % within "
        f"{spread.tenth:.1%} to {spread.ninetieth:.1%}"
    )


def _print_check(check: PaperCheck) -> None:
    print(
        "\ncalibrated on a set like the paper's; confused pairs of vibrations, share of all trials"
    )
    print(f"{'':<8} {'nine people':>12} {'observer':>10}")
    for name, people, machine in check.pairs:
        print(f"{name:<8} {people:>12.1%} {machine:>10.1%}")
    people, machine = check.temperature_slips
    print(f"{'hot-cold':<8} {people:>12.1%} {machine:>10.1%}")
    print(f"order of the ten pairs: Spearman {check.order:.2f}")


def _search(options: argparse.Namespace) -> None:
    from hapticvlm.commands.progress import working
    from hapticvlm_studio.design import patterns
    from hapticvlm_studio.observer import answers

    with working("searching, about half a minute"):
        chosen, nearest = answers.choose(patterns.candidates(wider=options.wider))
    if options.json:
        rows = [asdict(stimulus) for stimulus in chosen]
        print(json.dumps({"what": WHAT, "nearest_two_steps": nearest, "vibrations": rows}))
        return
    print(f"{WHAT}; nearest two: {nearest:.1f} Weber steps with level errors of up to 6 dB")
    for stimulus in chosen:
        print(
            f"  {stimulus.vibration:<16} {stimulus.speed_mps:>5g} m/s {stimulus.force_n:>4g} N, "
            f"{stimulus.repeats} in {stimulus.seconds:g} s"
        )
