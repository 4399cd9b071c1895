"""`hapticvlm study predict` and `choose`: what the machine observer makes of patterns."""

from __future__ import annotations

import argparse
import json
import math
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hapticvlm.commands.parsing import add_former, add_json
from hapticvlm.errors import usage_errors
from hapticvlm_studio.commands.layout import patterns_named

if TYPE_CHECKING:
    from hapticvlm.commands.parsing import Commands
    from hapticvlm_studio.observer.predict import PaperCheck, Prediction, Spread

SETS = ("ours", "twenty", "paper-like")
WHAT = "simulated: a machine observer, not people"
_PREDICT = """
Predict which patterns of a set are confused. A machine observer of vibration and heat answers: a
model, never a person. It has two free numbers, its noise for vibration and for heat. They are
calibrated so that a set like the paper's gives the paper's figures: 84.67 % of trials right, and
hot and cold confused in 4.2 %. The paper's stimuli are unpublished, so the prediction is a range
over guesses of them, not one number. Heat is what the simulated plate brings to the palm. The
random numbers are seeded. Exit code 2: the patterns cannot be read or presented.
"""
_CHOOSE = """
Search for strokes of the five vibrations that the machine observer confuses least. It takes about
half a minute. The shipped patterns were chosen like this, on other seeds than the reported ones.
"""


def add(parts: Commands) -> None:
    """Declare both parts of `hapticvlm study`."""
    predict = parts.add_parser(
        "predict",
        help="predict which patterns are confused",
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
        help="noise for heat, in Weber steps (the same as --noise)",
    )
    predict.add_argument(
        "--guesses",
        type=_count,
        default=20,
        metavar="N",
        help="how many guesses of the paper's stimuli, each calibrated; 0 is the shipped one alone "
        "(%(default)s)",
    )
    predict.add_argument(
        "--out", type=Path, metavar="FOLDER", help="draw matrices and curve into this folder"
    )
    add_former(predict, "--plots", "out")
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
    from hapticvlm_studio.observer import predict
    from hapticvlm_studio.observer.percepts import Noise

    stimuli = patterns_named(options.patterns)
    checked = spread = None
    if options.noise is None and options.heat_noise is not None:
        raise ValueError("--heat-noise needs --noise")
    with working("asking the machine observer"):
        if options.noise is None:
            checked = predict.check(predict.paper_noise())
            noise = checked.noise
            spread = predict.spread(stimuli, options.guesses) if options.guesses else None
        else:
            heat = options.noise if options.heat_noise is None else options.heat_noise
            noise = Noise(options.noise, heat)
        found = predict.predict(stimuli, noise)
        if options.out is not None:
            _draw(found, checked, options)
    if options.json:
        print(json.dumps(_document(found, checked, spread)))
        return
    _print(found, spread)
    if checked is not None:
        _print_check(checked)


def _draw(found: Prediction, checked: PaperCheck | None, options: argparse.Namespace) -> None:
    from hapticvlm_studio.design import paper
    from hapticvlm_studio.observer import plots, predict

    folder: Path = options.out
    folder.mkdir(parents=True, exist_ok=True)
    name = Path(options.patterns).stem
    plots.draw_matrix(found, folder / f"observer-{name}.png")
    others = {
        other: predict.predict(patterns_named(other), found.noise).curve
        for other in SETS
        if other != options.patterns
    }
    plots.draw_curves({name: found.curve, **others}, folder / "observer-noise.png")
    if checked is not None:
        path = folder / "observer-paper.png"
        plots.draw_check(checked, paper.confusion(), paper.CODES, path)


def _document(
    found: Prediction, checked: PaperCheck | None, spread: Spread | None
) -> dict[str, Any]:
    document = {"what": WHAT, **asdict(found), "counts": found.counts.tolist()}
    if spread is not None:
        document["guesses"] = asdict(spread)
    if checked is not None:
        document["paper_check"] = {**asdict(checked), "counts": checked.counts.tolist()}
    return document


def _print(found: Prediction, spread: Spread | None) -> None:
    from hapticvlm_studio.observer.answers import TRIALS

    noise = f"{found.noise.touch:.2f} (vibration) and {found.noise.heat:.2f} (heat)"
    print(f"{WHAT}; {TRIALS} trials a pattern at {noise} Weber steps of noise")
    print(f"recognised: {found.recognised:.1%} of {len(found.names)} patterns{_range(spread)}")
    name, share = found.one_feature
    print(f"  beside it: always one answer {found.constant:.1%}, best single feature {share:.1%}")
    print(f"  ({name}), vibration alone {found.touch_only:.1%}, heat alone {found.heat_only:.1%}")
    curve = ", ".join(f"x{factor:g} {share:.1%}" for factor, share in found.curve)
    print(f"  with other noise: {curve}")
    print("\nconfused most (presented, taken for, share of its trials):")
    for pair in found.pairs:
        print(f"  {pair.presented:<26} {pair.answered:<26} {pair.share:.1%}")
    if not found.pairs:
        print("  none in 0.5 % or more")
    wide = max(len(name) for name in found.names)
    print("\npresented, and % of its trials answered as each, in the same order:")
    for name, row in zip(found.names, found.counts, strict=True):
        print(f"  {name:<{wide}} " + " ".join(f"{100 * n / row.sum():3.0f}" for n in row))
    print("\nskin on the simulated plate, degC, as the first stroke begins and the last ends:")
    for name, (begin_c, end_c) in zip(found.names, found.palm_c, strict=True):
        print(f"  {name:<{wide}} {begin_c:.1f} {end_c:.1f}")


def _range(spread: Spread | None) -> str:
    """Return how much of the figure depends on the guess of the paper's stimuli."""
    if spread is None:
        return ""
    return (
        f" with the guess of the paper's stimuli\n  that is shipped; with {spread.count} others "
        f"{spread.lowest:.1%} to {spread.highest:.1%}, median {spread.median:.1%}, four in five "
        f"{spread.tenth:.1%} to {spread.ninetieth:.1%}"
    )


def _print_check(checked: PaperCheck) -> None:
    print("\ncalibrated on a set like the paper's; pairs of vibrations, share of all trials")
    print(f"{'':<8} {'nine people':>12} {'observer':>10}")
    for name, people, machine in checked.pairs:
        print(f"{name:<8} {people:>12.1%} {machine:>10.1%}")
    people, machine = checked.temperature_slips
    print(f"{'hot-cold':<8} {people:>12.1%} {machine:>10.1%}")
    print(f"order of the ten pairs: Spearman {checked.order:.2f}")


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
    print(f"{WHAT}; nearest two: {nearest:.1f} Weber steps, each level up to 6 dB off")
    for stimulus in chosen:
        print(
            f"  {stimulus.vibration:<16} {stimulus.speed_mps:>5g} m/s {stimulus.force_n:>4g} N, "
            f"{stimulus.repeats} in {stimulus.seconds:g} s"
        )
