"""`hapticvlm calibrate`: fit what differs from person to person, and from speaker to speaker."""

from __future__ import annotations

import argparse
import contextlib
import json
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from hapticvlm.commands.parsing import add_json, number_within
from hapticvlm.errors import UsageError, usage_errors
from hapticvlm.server.options import plate_resistance
from hapticvlm.server.settings import ServeOptions
from hapticvlm_studio.commands import calibrate_hand as hand
from hapticvlm_studio.commands import calibrate_plate as plate
from hapticvlm_studio.commands import calibrate_speaker as speaker

if TYPE_CHECKING:
    from hapticvlm.commands.parsing import Commands
    from hapticvlm.devices.plate.plate import Plate
    from hapticvlm_studio.calibration.palm_trial import Bench
    from hapticvlm_studio.calibration.staircase import Calibration

PRECONDITION_S = 3.0
TOUCH_S = 2.0
Judge = Callable[[float], bool | None]  # R'' of B: was the real object colder; None: no answer

_DESCRIPTION = """
Measure the contact resistance of a palm. You need a real piece of --object at room temperature, and
the result of `hapticvlm calibrate plate`. In each trial touch the object (A), then the plate (B),
two seconds each, and say which felt colder. The plate then tries another contact resistance.
Fifteen trials take about four minutes; q stops earlier. With --simulate R a simulated palm answers,
and no plate is needed.
"""


def add(commands: Commands) -> None:
    """Declare the command, with a subject each."""
    calibrate = commands.add_parser(
        "calibrate",
        help="fit the service to a person or a speaker",
        description="Fit the service to a person or to a speaker.",
    )
    subjects = calibrate.add_subparsers(title="subjects", required=True, metavar="WHAT")
    thermal = subjects.add_parser(
        "thermal",
        help="measure the contact resistance of a palm",
        description=_DESCRIPTION,
        examples=(
            "hapticvlm calibrate thermal --object metal --out palm.json",
            "hapticvlm calibrate thermal --simulate 2e-4",
        ),
    )
    plate.add(subjects)
    speaker.add(subjects)
    hand.add(subjects)
    thermal.set_defaults(run=_thermal)
    thermal.add_argument(
        "--object",
        default="metal",
        metavar="MATERIAL",
        help="material of the real object (%(default)s)",
    )
    thermal.add_argument(
        "--ambient-c",
        type=float,
        default=22.0,
        metavar="DEGC",
        help="temperature of room and object (%(default)s)",
    )
    thermal.add_argument(
        "--trials", type=int, default=15, metavar="N", help="how many trials (%(default)s)"
    )
    thermal.add_argument(
        "--peltier",
        default="auto",
        metavar="PORT",
        help="the plate: serial port, `auto` or `simulated` (%(default)s)",
    )
    thermal.add_argument(
        "--plate-resistance",
        type=_between,
        default=ServeOptions().plate_resistance,
        metavar="R_OR_FILE",
        help="resistance between palm and plate in m2 K/W that the plate compensates, or a file "
        "that `hapticvlm calibrate plate` wrote (%(default)s)",
    )
    thermal.add_argument(
        "--simulate",
        type=float,
        metavar="R",
        help="let a simulated palm of this contact resistance in m2 K/W answer",
    )
    thermal.add_argument(
        "--seed",
        type=int,
        default=0,
        metavar="N",
        help="seed of the simulated palm (%(default)s)",
    )
    add_json(thermal)
    thermal.add_argument(
        "--out",
        type=Path,
        metavar="FILE",
        help="write the result here, for `hapticvlm serve --contact-resistance FILE`",
    )


def _between(text: str) -> float:
    """Read a plate resistance that the service takes."""
    return number_within(0.0, 0.005)(repr(plate_resistance(text)))


def _thermal(options: argparse.Namespace) -> int:
    with usage_errors():
        calibration = _begin(options)
        try:
            with _judge(options, calibration) as judge:
                _ask(calibration, judge, options)
        except EOFError:
            raise UsageError("no more answers: the calibration is not finished") from None
        return _report(calibration, options)


def _begin(options: argparse.Namespace) -> Calibration:
    """Check the options; raises ValueError."""
    from hapticvlm.materials import MATERIALS
    from hapticvlm.perception import NEUTRAL_C
    from hapticvlm_studio.calibration.staircase import RESISTANCES, Calibration

    if options.object not in MATERIALS:
        raise ValueError(f"--object {options.object}: not one of {', '.join(MATERIALS)}")
    if not 0.0 <= options.ambient_c <= NEUTRAL_C - 4.0:
        raise ValueError("--ambient-c: needs 0 to 28 degC; nearer to skin there is little to feel")
    if not 1 <= options.trials <= 100:
        raise ValueError("--trials: needs 1 to 100")
    low = float(RESISTANCES[0])
    high = float(RESISTANCES[-1])
    if options.simulate is not None and not low <= options.simulate <= high:
        raise ValueError(f"--simulate: needs {low:g} to {high:g} m2 K/W")
    return Calibration(MATERIALS[options.object].thermal, options.ambient_c)


@contextlib.contextmanager
def _judge(options: argparse.Namespace, calibration: Calibration) -> Iterator[Judge]:
    """Offer who answers: a simulated palm, or a person with a plate."""
    if options.simulate is not None:
        from hapticvlm_studio.calibration.staircase import SimulatedPalm

        palm = SimulatedPalm(options.simulate, seed=options.seed)
        thermal = calibration.thermal
        ambient_c = calibration.ambient_c
        yield lambda tried: palm.is_real_colder(thermal, ambient_c, tried)
        return
    from hapticvlm_studio.calibration.palm_trial import Bench

    plate = _plate(options.peltier)
    bench = Bench(plate, options.plate_resistance)
    try:
        yield lambda tried: _person(bench, calibration, tried, options.object)
    finally:
        bench.close()
        plate.close()


def _plate(port: str) -> Plate:
    if port == "simulated":
        from hapticvlm.devices.simulated.simulated import SimulatedPlate

        print("the plate is simulated: there is nothing to feel, answers are a rehearsal")
        return SimulatedPlate()
    from hapticvlm.devices.plate.peltier import Peltier

    plate = Peltier(port)
    plate.start()
    return plate


def _ask(calibration: Calibration, judge: Judge, options: argparse.Namespace) -> None:
    """Run the trials; no answer ends them."""
    for trial in range(1, options.trials + 1):
        tried = calibration.next_resistance()
        if not options.json:
            print(f"trial {trial} of {options.trials}: B at R'' {tried:.2g}", flush=True)
        real_was_colder = judge(tried)
        if real_was_colder is None:
            return
        calibration.learn(tried, real_was_colder=real_was_colder)


def _person(bench: Bench, calibration: Calibration, tried: float, name: str) -> bool | None:
    """Lead a person through one trial."""
    from hapticvlm.rendering.heat.contact import thermal_contact

    contact = thermal_contact(calibration.thermal, calibration.ambient_c, contact_resistance=tried)
    input(f"  A: lay your palm on the real {name} for two seconds, lift it, press Enter ")
    bench.prepare(contact)
    print("  the plate gets ready ...", flush=True)
    time.sleep(PRECONDITION_S)
    input("  B: press Enter and lay your palm on the plate at once ")
    bench.touch()
    time.sleep(TOUCH_S)
    bench.release()
    while True:
        answer = input("  lift it. Which felt colder, a or b (q to stop)? ").strip().lower()
        if answer in ("a", "b", "q"):
            return None if answer == "q" else answer == "a"


def _report(calibration: Calibration, options: argparse.Namespace) -> int:
    found = calibration.estimate()
    if found.trials == 0:
        print("hapticvlm calibrate thermal: no trial was answered", file=sys.stderr)
        return 1
    result = {"calibrate": "thermal", "object": options.object, "ambient_c": options.ambient_c}
    result |= {"plate_resistance": options.plate_resistance}
    result |= {"simulated": options.simulate is not None, **asdict(found)}
    line = json.dumps(result)
    if options.out is not None:
        options.out.write_text(line + "\n", encoding="utf-8")
    if options.json:
        print(line)
    else:
        print(
            f"contact resistance {found.contact_resistance:.2g} m2 K/W (95 % {found.low:.2g} to "
            f"{found.high:.2g}) after {found.trials} trials; comparisons had a noise of about "
            f"{found.noise_c:.1f} degC"
        )
        kept = f"{found.contact_resistance:.2g}" if options.out is None else options.out
        print(
            f"use it: --contact-resistance {kept} --plate-resistance {options.plate_resistance:g}"
        )
    return 0
