"""`hapticvlm calibrate`: adapts the service to a person or to a speaker; holds `thermal`."""

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
from hapticvlm.errors import UsageError, shell_word, usage_errors
from hapticvlm.server.options import plate_resistance
from hapticvlm.server.settings import ServeOptions
from hapticvlm_studio.commands import calibrate_hand as hand
from hapticvlm_studio.commands import calibrate_plate as plate
from hapticvlm_studio.commands import calibrate_speaker as speaker

if TYPE_CHECKING:
    from hapticvlm.commands.parsing import Commands
    from hapticvlm.devices.plate.plate import Plate
    from hapticvlm_studio.calibration.contact_estimate import ContactEstimator
    from hapticvlm_studio.calibration.plate_driver import PlateDriver

PRECONDITION_S = 3.0
TOUCH_S = 2.0
# R'' of B -> whether the real object felt colder, or None to stop
Judge = Callable[[float], bool | None]

_DESCRIPTION = """
Measure the contact resistance of a palm. You need a real piece of --object at room temperature, and
the result of `hapticvlm calibrate plate`. In each trial touch the object (A) and then the plate (B)
for two seconds each, and answer which felt colder. The plate then tries another contact resistance.
Fifteen trials take about four minutes; q stops earlier. With --simulate R a simulated palm answers,
and no plate is needed.
"""


def add(commands: Commands) -> None:
    """Declare the command and its subjects."""
    calibrate = commands.add_parser(
        "calibrate",
        help="adapt the service to a person or a speaker",
        description="Adapt the service to a person or to a speaker.",
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
        "--trials", type=int, default=15, metavar="N", help="number of trials (%(default)s)"
    )
    thermal.add_argument(
        "--peltier",
        default="auto",
        metavar="PORT",
        help="plate: serial port, `auto` or `simulated` (%(default)s)",
    )
    thermal.add_argument(
        "--plate-resistance",
        type=_plate_resistance,
        default=ServeOptions().plate_resistance,
        metavar="R_OR_FILE",
        help="resistance between palm and plate that the plate compensates, m2 K/W, or a file "
        "written by `hapticvlm calibrate plate` (%(default)s)",
    )
    thermal.add_argument(
        "--simulate",
        type=float,
        metavar="R",
        help="let a simulated palm of this contact resistance answer, m2 K/W",
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


def _plate_resistance(text: str) -> float:
    """Return a plate resistance that the service accepts."""
    return number_within(0.0, 0.005)(repr(plate_resistance(text)))


def _thermal(options: argparse.Namespace) -> int:
    with usage_errors():
        estimator = _estimator(options)
        try:
            with _judge(options, estimator) as judge:
                _run(estimator, judge, options)
        except EOFError:
            raise UsageError("no more answers: nothing was calibrated") from None
        return _report(estimator, options)


def _estimator(options: argparse.Namespace) -> ContactEstimator:
    """Check the options and return an estimator without answers. Raises ValueError."""
    from hapticvlm.materials import MATERIALS
    from hapticvlm.perception import NEUTRAL_C
    from hapticvlm_studio.calibration.contact_estimate import RESISTANCES, ContactEstimator

    if options.object not in MATERIALS:
        raise ValueError(f"--object {options.object}: not one of {', '.join(MATERIALS)}")
    if not 0.0 <= options.ambient_c <= NEUTRAL_C - 4.0:
        raise ValueError(
            "--ambient-c: must be 0 to 28 degC; nearer to the skin there is little to feel"
        )
    if not 1 <= options.trials <= 100:
        raise ValueError("--trials: must be 1 to 100")
    low = float(RESISTANCES[0])
    high = float(RESISTANCES[-1])
    if options.simulate is not None and not low <= options.simulate <= high:
        raise ValueError(f"--simulate: must be {low:g} to {high:g} m2 K/W")
    return ContactEstimator(MATERIALS[options.object].thermal, options.ambient_c)


@contextlib.contextmanager
def _judge(options: argparse.Namespace, estimator: ContactEstimator) -> Iterator[Judge]:
    """Yield a function that answers a trial: a simulated palm, or a person with a plate."""
    if options.simulate is not None:
        from hapticvlm_studio.calibration.contact_estimate import SimulatedPalm

        palm = SimulatedPalm(options.simulate, seed=options.seed)
        thermal = estimator.thermal
        ambient_c = estimator.ambient_c
        yield lambda resistance: palm.is_real_colder(thermal, ambient_c, resistance)
        return
    from hapticvlm_studio.calibration.plate_driver import PlateDriver

    plate = _plate(options.peltier)
    driver = PlateDriver(plate, options.plate_resistance)
    try:
        yield lambda resistance: _person(driver, estimator, resistance, options.object)
    finally:
        driver.close()
        plate.close()


def _plate(port: str) -> Plate:
    if port == "simulated":
        from hapticvlm.devices.simulated.simulated import SimulatedPlate

        print("the plate is simulated: there is nothing to feel, this is only a rehearsal")
        return SimulatedPlate()
    from hapticvlm.devices.plate.peltier import Peltier

    plate = Peltier(port)
    plate.start()
    return plate


def _run(estimator: ContactEstimator, judge: Judge, options: argparse.Namespace) -> None:
    """Run the trials, or as many as are answered."""
    for trial in range(1, options.trials + 1):
        resistance = estimator.next_resistance()
        if not options.json:
            print(f"trial {trial} of {options.trials}: B at R'' {resistance:.2g}", flush=True)
        real_was_colder = judge(resistance)
        if real_was_colder is None:
            return
        estimator.learn(resistance, real_was_colder=real_was_colder)


def _person(
    driver: PlateDriver, estimator: ContactEstimator, resistance: float, name: str
) -> bool | None:
    """Guide a person through one trial; None where they stop. Raises EOFError."""
    from hapticvlm.rendering.heat.contact import thermal_contact

    contact = thermal_contact(estimator.thermal, estimator.ambient_c, contact_resistance=resistance)
    input(f"  A: lay your palm on the real {name} for two seconds, lift it, press Enter ")
    driver.prepare(contact)
    print("  the plate is getting ready ...", flush=True)
    time.sleep(PRECONDITION_S)
    input("  B: press Enter and immediately lay your palm on the plate ")
    driver.touch()
    time.sleep(TOUCH_S)
    driver.release()
    while True:
        answer = input("  lift your palm. Which felt colder, a or b (q to stop)? ").strip().lower()
        if answer in ("a", "b", "q"):
            return None if answer == "q" else answer == "a"


def _report(estimator: ContactEstimator, options: argparse.Namespace) -> int:
    palm = estimator.estimate()
    if palm.trials == 0:
        print("hapticvlm calibrate thermal: no trial was answered", file=sys.stderr)
        return 1
    result = {"calibrate": "thermal", "object": options.object, "ambient_c": options.ambient_c}
    result |= {"plate_resistance": options.plate_resistance}
    result |= {"simulated": options.simulate is not None, **asdict(palm)}
    line = json.dumps(result)
    if options.out is not None:
        options.out.write_text(line + "\n", encoding="utf-8")
    if options.json:
        print(line)
    else:
        print(
            f"contact resistance {palm.contact_resistance:.2g} m2 K/W (95 % {palm.low:.2g} to "
            f"{palm.high:.2g}) after {palm.trials} trials; the noise of a comparison was about "
            f"{palm.noise_c:.1f} degC"
        )
        value = f"{palm.contact_resistance:.2g}" if options.out is None else shell_word(options.out)
        used = f"--contact-resistance {value} --plate-resistance {options.plate_resistance:g}"
        print(f"to use it: hapticvlm serve {used}")
    return 0
