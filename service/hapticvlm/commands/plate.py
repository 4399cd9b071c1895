"""`hapticvlm plate` reads a plate on a serial port, clears its faults or writes its firmware."""

from __future__ import annotations

import argparse
import dataclasses
import json
import time
from collections.abc import Callable, Collection
from pathlib import Path
from typing import TYPE_CHECKING

from hapticvlm.commands import plate_simulate
from hapticvlm.commands.parsing import add_json
from hapticvlm.errors import usage_errors

if TYPE_CHECKING:
    from hapticvlm.commands.parsing import Commands
    from hapticvlm.devices.plate.peltier import Peltier
    from hapticvlm.rendering.heat.limits import PlateReading

LISTEN_S = 0.5  # ten telemetries


def add(commands: Commands) -> None:
    """Declare the command and its options."""
    plate = commands.add_parser(
        "plate",
        help="read a plate on a serial port, clear a fault, or write its firmware",
        description="Read or change a plate on a serial port. Only one program can use "
        "the port: stop the service first.",
        examples=(
            "hapticvlm plate simulate",
            "hapticvlm plate status --port /dev/ttyUSB0",
            "hapticvlm plate clear runaway",
            "hapticvlm plate flash --port /dev/ttyUSB0",
        ),
    )
    verbs = plate.add_subparsers(title="commands", required=True, metavar="WHAT")
    status = _add(verbs, "status", "print readings, faults and counts", _status)
    add_json(status)
    clear = _add(verbs, "clear", "clear one fault; the plate stays off", _clear)
    clear.add_argument(
        "fault",
        nargs="?",
        metavar="FAULT",
        help="name or number of the fault, as `plate status` prints it; without it, the faults "
        "that are latched are listed",
    )
    _add_flash(verbs)
    plate_simulate.add(verbs)


def _add(
    verbs: Commands, name: str, summary: str, run: Callable[[Peltier, argparse.Namespace], None]
) -> argparse.ArgumentParser:
    description = f"{summary[0].upper()}{summary[1:]}."
    verb = verbs.add_parser(name, help=summary, description=description)
    _add_port(verb, "serial port, `auto` or `simulated` (%(default)s)")
    verb.set_defaults(run=lambda options: _with_plate(options, run))
    return verb


def _add_port(verb: argparse.ArgumentParser, summary: str) -> None:
    verb.add_argument(
        "--port", "--peltier", dest="port", default="auto", metavar="PORT", help=summary
    )


def _add_flash(verbs: Commands) -> None:
    flash = verbs.add_parser(
        "flash",
        help="write the firmware to an Uno or Nano",
        description="Write the firmware to an Arduino Uno or Nano with avrdude, then ask the "
        "board for its version. Without --port only a board that answers as a plate is "
        "written, because another board may hold another program.",
        examples=(
            "hapticvlm plate flash                      update a plate",
            "hapticvlm plate flash --port /dev/ttyUSB0  write a new board",
            "hapticvlm plate flash --port /dev/ttyUSB0 --one-resistor",
        ),
    )
    _add_port(flash, "the board's serial port (%(default)s)")
    flash.add_argument(
        "--one-resistor",
        action="store_true",
        help="write the firmware of the plate of one resistor; an update keeps it",
    )
    flash.add_argument(
        "--hex", type=Path, metavar="FILE", help="Intel HEX file to write (the shipped one)"
    )
    flash.add_argument(
        "--dry-run", action="store_true", help="ask the board for its version, and write nothing"
    )
    flash.set_defaults(run=_flash)


def _flash(options: argparse.Namespace) -> int:
    from hapticvlm.commands import flash

    return flash.flash(
        options.port, options.hex, one_resistor=options.one_resistor, dry_run=options.dry_run
    )


def _with_plate(
    options: argparse.Namespace, run: Callable[[Peltier, argparse.Namespace], None]
) -> int:
    from hapticvlm.devices.plate.peltier import Peltier
    from hapticvlm.devices.simulated.simulated_board import simulated_plate

    plate = simulated_plate() if options.port == "simulated" else Peltier(options.port)
    try:
        plate.connect()
        with usage_errors():
            run(plate, options)
    finally:
        plate.close()
    return 0


def _reading(plate: Peltier) -> PlateReading:
    """Listen for some telemetry and return what the plate reports."""
    until = time.monotonic() + LISTEN_S
    while time.monotonic() < until:
        plate.poll()
    return plate.advance(time.monotonic())


def _status(plate: Peltier, options: argparse.Namespace) -> None:
    reading = _reading(plate)
    if options.json:
        report = {"plate": plate.name, "simulated": plate.simulated, "lag_s": plate.lag_s}
        print(json.dumps({**report, **dataclasses.asdict(reading), "counts": plate.counts}))
        return
    print(plate.name)
    print(f"  plate {_degrees(reading.plate_c)}, sink {_degrees(reading.sink_c)}")
    print(f"  dose {reading.dose_cem43:.3f} CEM43, heated {reading.heated_s:.0f} s")
    lag = "unknown: hapticvlm calibrate plate" if plate.lag_s is None else f"{plate.lag_s:.2f} s"
    print(f"  lag of the thermistors {lag}")
    for name, count in plate.counts.items():
        if count:
            print(f"  {name.replace('_', ' ')} {count}")
    _print_faults(reading.faults, options.port)


def _print_faults(names: Collection[str], port: str) -> None:
    """Print each fault, and how to clear those that latch."""
    from hapticvlm.devices.faults import FIRMWARE, describe

    latching = {fault.name for fault in FIRMWARE.values()}
    there = "" if port == "auto" else f" --port {port}"
    for name in names:
        print(f"  FAULT {describe(name)}")
        if name in latching:
            print(f"        then run: hapticvlm plate clear {name}{there}")
    if not names:
        print("  no faults")


def _clear(plate: Peltier, options: argparse.Namespace) -> None:
    if options.fault is None:
        _print_faults(_reading(plate).faults, options.port)
        return
    plate.clear(options.fault)
    print(f"{options.fault} cleared; the plate stays off until the next setpoint")


def _degrees(temperature_c: float | None) -> str:
    return "no reading" if temperature_c is None else f"{temperature_c:.1f} degC"
