"""`hapticvlm calibrate plate`: measure how well a palm lies on the plate."""

from __future__ import annotations

import argparse
import json
import math
import sys
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from hapticvlm.commands.parsing import add_json, number_within
from hapticvlm.errors import UsageError

if TYPE_CHECKING:
    from hapticvlm.commands.parsing import Commands
    from hapticvlm_studio.calibration.plate_flow import PlateEstimate

_DESCRIPTION = """
Measure the resistance between a palm and the plate from the heat that the palm takes. The plate
swings gently for 72 s with nothing on it, and again with your palm at rest on it; it asks for each.
Nothing is to be judged. `hapticvlm serve` and `hapticvlm calibrate thermal` take the result. With
--simulate R a simulated palm lies on a simulated plate.
"""


def add(subjects: Commands) -> None:
    """Declare `calibrate plate`."""
    plate = subjects.add_parser(
        "plate",
        help="measure the resistance between a palm and the plate",
        description=_DESCRIPTION,
        examples=(
            "hapticvlm calibrate plate --out plate.json",
            "hapticvlm calibrate plate --simulate 5e-4",
        ),
    )
    plate.set_defaults(run=_plate)
    plate.add_argument(
        "--peltier",
        default="auto",
        metavar="PORT",
        help="the plate: serial port or `auto` (%(default)s)",
    )
    plate.add_argument(
        "--simulate",
        type=number_within(1e-4, 2e-3),
        metavar="R",
        help="simulate plate and palm, with this resistance between them in m2 K/W",
    )
    add_json(plate)
    plate.add_argument(
        "--out",
        type=Path,
        metavar="FILE",
        help="write the result here, for `--plate-resistance FILE` of `hapticvlm serve` and "
        "`hapticvlm calibrate thermal`",
    )


def _plate(options: argparse.Namespace) -> int:
    if options.simulate is not None:
        return _report(_simulated(options.simulate), options)
    if options.peltier == "simulated":
        raise UsageError("no palm lies on a simulated plate: give --simulate 5e-4 instead")
    try:
        return _report(_person(options.peltier), options)
    except EOFError:
        raise UsageError("nobody pressed Enter: the plate is not calibrated") from None


def _simulated(resistance: float) -> PlateEstimate:
    from hapticvlm.devices.simulated.simulated import SimulatedPlate
    from hapticvlm_studio.calibration.plate_course import simulated_time, swing
    from hapticvlm_studio.calibration.plate_flow import estimate, middle_c

    plate = SimulatedPlate(palm_resistance=math.inf)
    turn = simulated_time()
    around_c = middle_c(plate.advance(turn()).sink_c)
    bare = swing(plate, around_c, turn)
    plate.touch(resistance)
    return estimate(bare, swing(plate, around_c, turn))


def _person(port: str) -> PlateEstimate:
    """Lead a person through both runs; before, between and after them the plate is off."""
    from hapticvlm.devices.plate.peltier import Peltier
    from hapticvlm_studio.calibration.plate_course import real_time, swing
    from hapticvlm_studio.calibration.plate_flow import RUN_S, estimate, middle_c

    plate = Peltier(port)
    plate.start()
    try:
        _ask("1 of 2: take everything off the plate, and press Enter")
        around_c = middle_c(plate.advance(real_time()).sink_c)
        _tell(f"touch nothing for {RUN_S:g} s ...")
        bare = swing(plate, around_c, real_time)
        _ask(
            "2 of 2: lay your palm on the plate as you will when you use it, keep it still, and "
            "press Enter with the other hand"
        )
        _tell(f"keep still for {RUN_S:g} s; Ctrl-C stops the plate ...")
        return estimate(bare, swing(plate, around_c, real_time))
    finally:
        plate.close()


def _ask(text: str) -> None:
    _tell(text)
    input()


def _tell(text: str) -> None:
    """Speak to the person; the output may be a program's."""
    print(text, file=sys.stderr, flush=True)


def _report(found: PlateEstimate, options: argparse.Namespace) -> int:
    """Print what was found before it is written: a file that can't be must not lose it."""
    result = {"calibrate": "plate", "simulated": options.simulate is not None, **asdict(found)}
    line = json.dumps(result)
    rounded = f"{found.plate_resistance:.2g}"
    if options.json:
        print(line)
    else:
        print(f"plate resistance {rounded} m2 K/W (95 % {found.low:.2g} to {found.high:.2g})")
    if options.out is not None:
        options.out.write_text(line + "\n", encoding="utf-8")
    if not options.json:
        print(f"use it: --plate-resistance {options.out or rounded}")
    return 0
