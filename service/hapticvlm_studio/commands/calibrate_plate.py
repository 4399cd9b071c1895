"""`hapticvlm calibrate plate`: measures the thermal resistance between a palm and the plate."""

from __future__ import annotations

import argparse
import json
import math
import sys
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from hapticvlm import documents
from hapticvlm.commands.parsing import add_json, number_within
from hapticvlm.errors import UsageError, shell_word

if TYPE_CHECKING:
    from hapticvlm.commands.parsing import Commands
    from hapticvlm_studio.calibration.plate_flow import PlateEstimate

_DESCRIPTION = """
Measure the resistance between a palm and the plate from the heat that flows into the palm. The
temperature of the plate swings gently for 72 s with nothing on it, and again with your palm at rest
on it; the command asks for each. You are not asked what you feel. `hapticvlm serve` uses the
result. The first run also shows by how much the plate's thermistors lag behind its face, and the
board keeps that lag: do this once for a new plate. With --simulate R a simulated palm lies on a
simulated plate.
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
        help="plate: serial port or `auto` (%(default)s)",
    )
    plate.add_argument(
        "--simulate",
        type=number_within(1e-4, 2e-3),
        metavar="R",
        help="simulate plate and palm with this resistance between them, m2 K/W",
    )
    add_json(plate)
    plate.add_argument(
        "--out",
        type=Path,
        metavar="FILE",
        help="write the result here, for `hapticvlm serve --plate-resistance FILE`",
    )


def _plate(options: argparse.Namespace) -> int:
    if options.simulate is not None:
        return _report(_simulated(options.simulate), options)
    if options.peltier == "simulated":
        raise UsageError("a simulated plate has no palm on it: give --simulate 5e-4 instead")
    try:
        return _report(_person(options.peltier), options)
    except EOFError:
        raise UsageError("input ended before Enter was pressed; nothing was calibrated") from None


def _simulated(resistance: float) -> PlateEstimate:
    from hapticvlm.devices.simulated.simulated import SimulatedPlate
    from hapticvlm_studio.calibration.plate_flow import estimate, middle_c
    from hapticvlm_studio.calibration.plate_trajectory import simulated_time, swing

    plate = SimulatedPlate(palm_resistance=math.inf)
    next_tick = simulated_time()
    around_c = middle_c(plate.advance(next_tick()).sink_c)
    bare = swing(plate, around_c, next_tick)
    plate.touch(resistance)
    return estimate(bare, swing(plate, around_c, next_tick))


def _person(port: str) -> PlateEstimate:
    """Guide a person through both runs; the plate is off before, between and after them."""
    from hapticvlm.devices.plate.peltier import Peltier
    from hapticvlm_studio.calibration.plate_flow import RUN_S, bead_lag_s, estimate, middle_c
    from hapticvlm_studio.calibration.plate_trajectory import real_time, swing

    plate = Peltier(port)
    plate.start()
    try:
        _ask("1 of 2: take everything off the plate and press Enter")
        around_c = middle_c(plate.advance(real_time()).sink_c)
        _print(f"do not touch the plate for {RUN_S:g} s ...")
        bare = swing(plate, around_c, real_time)
        plate.keep_lag(bead_lag_s(bare))
        _ask(
            "2 of 2: lay your palm on the plate as in use, keep it still and press Enter with the "
            "other hand"
        )
        _print(f"keep your palm still for {RUN_S:g} s; Ctrl-C stops the plate ...")
        return estimate(bare, swing(plate, around_c, real_time))
    finally:
        plate.close()


def _ask(instruction: str) -> None:
    """Print an instruction and wait for Enter. Raises EOFError."""
    _print(instruction)
    input()


def _print(instruction: str) -> None:
    """Print for the person on standard error; standard output may go to a program."""
    print(instruction, file=sys.stderr, flush=True)


def _report(palm: PlateEstimate, options: argparse.Namespace) -> int:
    """Print the result, then write it: a file that cannot be written must not lose it."""
    result = {"calibrate": "plate", "simulated": options.simulate is not None, **asdict(palm)}
    line = json.dumps(result)
    rounded = f"{palm.plate_resistance:.2g}"
    if options.json:
        print(line)
    else:
        print(f"plate resistance {rounded} m2 K/W (95 % {palm.low:.2g} to {palm.high:.2g})")
        print(f"the plate's thermistors lag by {palm.lag_s:.2f} s")
    if options.out is not None:
        documents.replace_file(options.out, line + "\n")
    if not options.json:
        value = rounded if options.out is None else shell_word(options.out)
        print(f"to use it: hapticvlm serve --plate-resistance {value}")
    return 0
