"""`hapticvlm feel`: computes what a touch of a material feels like, without scene or service."""

from __future__ import annotations

import argparse
import json
import math
import sys
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hapticvlm.commands import touch_options
from hapticvlm.commands.parsing import add_json, number_within
from hapticvlm.errors import usage_errors
from hapticvlm.rendering.touch_ranges import RANGES
from hapticvlm.rendering.vibration.vibration import INTERACTIONS
from hapticvlm.server.options import contact_resistance

if TYPE_CHECKING:
    from hapticvlm.commands.parsing import Commands
    from hapticvlm.materials import Material
    from hapticvlm.touches.felt import FeltTouch
    from hapticvlm.touches.heat import Heat

SHOWN_S = (0.0, 0.1, 0.25, 0.5, 1.0, 2.0, 5.0, 10.0)

_DESCRIPTION = """
Compute what touching a material feels like. The command prints the temperature of the skin, the
setpoint of the plate, the limit that acted, and the vibration. --plot draws them and --wav writes
the vibration. It uses neither a service nor a device. In Python `hapticvlm.feel` is the same.
"""


def add(commands: Commands) -> None:
    """Declare the command and its options."""
    feel = commands.add_parser(
        "feel",
        help="compute what a touch feels like",
        description=_DESCRIPTION,
        examples=(
            "hapticvlm feel metal --object-c 5",
            "hapticvlm feel wood --interaction slide --speed 0.2 --plot wood.svg --wav wood.wav",
            "hapticvlm feel glass --wav glass.wav --voice sound",
        ),
    )
    feel.set_defaults(run=_feel)
    feel.add_argument(
        "material", metavar="MATERIAL", help="material, such as wood, glass, fabric or metal"
    )
    _add_heat(feel)
    sound = feel.add_argument_group("vibration")
    sound.add_argument(
        "--interaction",
        choices=INTERACTIONS,
        help="how the hand touches (a strike, then a slide from 0.4 s on)",
    )
    sound.add_argument(
        "--speed",
        type=number_within(*RANGES["speed_mps"]),
        metavar="M_PER_S",
        help="highest speed of a stroke in m/s (0.3; swing 5)",
    )
    touch_options.add_force(sound)
    touch_options.add_recordings(sound)
    out = feel.add_argument_group("output")
    touch_options.add_seconds(out, 5.0)
    out.add_argument("--plot", type=Path, metavar="FILE", help="draw the touch to this .svg file")
    out.add_argument(
        "--wav", type=Path, metavar="FILE", help="write the vibration to this file, 48 kHz mono"
    )
    touch_options.add_voice(out, "true", "voice of --wav (true)")
    add_json(out)
    touch_options.add_gallery(out)


def _add_heat(feel: argparse.ArgumentParser) -> None:
    heat = feel.add_argument_group("temperature")
    touch_options.add_temperatures(heat)
    heat.add_argument(
        "--skin-c",
        type=number_within(*RANGES["skin_c"]),
        default=32.0,
        metavar="DEGC",
        help="temperature of the skin before the touch (%(default)s)",
    )
    heat.add_argument(
        "--contact-resistance",
        type=_palm,
        metavar="R_OR_FILE",
        help="contact resistance of skin and object in m2 K/W, or a file written by `hapticvlm "
        "calibrate thermal` (that of the material)",
    )
    heat.add_argument(
        "--thickness-m",
        type=number_within(*RANGES["thickness_m"]),
        metavar="M",
        help="thickness of an object that is a sheet or rod, in m (thick)",
    )


def _palm(text: str) -> float:
    """Return a contact resistance that skin and object can have."""
    return number_within(*RANGES["contact_resistance"])(repr(contact_resistance(text)))


def _feel(options: argparse.Namespace) -> int:
    from hapticvlm.commands.progress import working
    from hapticvlm.materials import find
    from hapticvlm.rendering.vibration.sound_voice import in_voice
    from hapticvlm.touches.sound import write_wav

    with usage_errors():
        material = find(options.material, touch_options.table(options.gallery))
        with working("computing the touch"):
            touch = _touch(material, options)
            if options.wav is not None:
                write_wav(options.wav, in_voice(touch.vibration, options.voice))
            if options.plot is not None:
                touch.plot().save(options.plot)
    if options.json:
        document = {"thermal": asdict(touch.heat), "vibration": touch.sound.describe()}
        print(json.dumps(document), flush=True)
    else:
        _print(touch.heat, touch.sound.describe())
        sys.stdout.flush()
    return 0


def _touch(material: Material, options: argparse.Namespace) -> FeltTouch:
    from hapticvlm.materials import MATERIALS
    from hapticvlm.touches.felt import feel

    # A recording may be of another material than the one that is touched.
    others = {} if options.patterns is None else MATERIALS
    return feel(
        material,
        options.interaction,
        object_c=options.object_c,
        ambient_c=options.ambient_c,
        skin_c=options.skin_c,
        contact_resistance=options.contact_resistance,
        thickness_m=options.thickness_m,
        speed_mps=options.speed,
        force_n=options.force,
        seconds=options.seconds,
        voices=touch_options.voices(options, {**others, material.name: material}),
    )


def _print(heat: Heat, vibration: dict[str, Any]) -> None:
    print(f"{heat.material} at {heat.surface_c:g} degC, skin at {heat.skin_start_c:g} degC")
    print(
        f"effusivity {heat.effusivity:.0f} (skin {heat.skin_effusivity:.0f}) W s^0.5/(m2 K), "
        f"contact resistance {heat.contact_resistance:.2g} m2 K/W, "
        f"contact temperature {heat.contact_c:.1f} degC"
    )
    if not heat.thermal_cue:
        print("no thermal cue: object and skin differ too little to be felt as warm or cold")
    print(f"\n{'s':>6} {'skin degC':>10} {'setpoint degC':>14}  limited by")
    for shown_s in SHOWN_S:
        if shown_s <= heat.time_s[-1]:
            at = min(range(len(heat.time_s)), key=lambda i: abs(heat.time_s[i] - shown_s))
            values = f"{heat.skin_c[at]:>10.2f} {heat.setpoint_c[at]:>14.2f}"
            print(f"{heat.time_s[at]:>6.2f} {values}  {heat.limited_by[at] or '-'}")
    levels = vibration["spectrum"]["level_db"]
    loudest_hz = vibration["spectrum"]["frequency_hz"][levels.index(max(levels))]
    modes = ", ".join(f"{mode['frequency_hz']:g} Hz" for mode in vibration["modes"])
    print(f"\n{vibration['interaction']}: modes {modes}; texture {vibration['texture_hz']:.0f} Hz")
    rms_db = 20.0 * math.log10(max(vibration["rms"], 1e-8))
    print(
        f"peak {vibration['peak']:.2f}, level {rms_db:.0f} dB re full scale, strongest near "
        f"{loudest_hz:.0f} Hz, {100 * vibration['share_1_to_1000_hz']:.1f} % within 1-1000 Hz"
    )
