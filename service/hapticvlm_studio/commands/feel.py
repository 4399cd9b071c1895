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
from hapticvlm.rendering.vibration.vibration import INTERACTIONS
from hapticvlm.server.options import contact_resistance

if TYPE_CHECKING:
    from hapticvlm.commands.parsing import Commands
    from hapticvlm.materials import Material
    from hapticvlm_studio.touches.heat import Heat, ThermalInputs
    from hapticvlm_studio.touches.sound import Sound

SHOWN_S = (0.0, 0.1, 0.25, 0.5, 1.0, 2.0, 5.0, 10.0)
SPEED_MPS = 0.3
SWING_MPS = 5.0

_DESCRIPTION = """
Compute what touching a material feels like. The command prints the temperature of the skin, the
setpoint of the plate, the limit that acted, and the vibration. --plot draws them and --wav writes
the vibration. It uses neither a service nor a device.
"""


def add(commands: Commands) -> None:
    """Declare the command and its options."""
    feel = commands.add_parser(
        "feel",
        help="compute what a touch feels like",
        description=_DESCRIPTION,
        examples=(
            "hapticvlm feel metal --object-c 5",
            "hapticvlm feel wood --interaction slide --speed 0.2 --plot wood.png --wav wood.wav",
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
        type=number_within(0.0, 20.0),
        metavar="M_PER_S",
        help="highest speed of a stroke in m/s (0.3; swing 5)",
    )
    touch_options.add_force(sound)
    touch_options.add_recordings(sound)
    out = feel.add_argument_group("output")
    touch_options.add_seconds(out, 5.0)
    out.add_argument(
        "--plot", type=Path, metavar="FILE", help="draw the touch to this .png, .svg or .pdf file"
    )
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
        type=number_within(10.0, 45.0),
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
        type=number_within(1e-6, 10.0),
        metavar="M",
        help="thickness of an object that is a sheet or rod, in m (thick)",
    )


def _palm(text: str) -> float:
    """Return a contact resistance that skin and object can have."""
    return number_within(0.0, 1.0)(repr(contact_resistance(text)))


def _feel(options: argparse.Namespace) -> int:
    from hapticvlm.commands.progress import working

    with usage_errors():
        material = touch_options.find(options.material, touch_options.table(options.gallery))
        with working("computing the touch"):
            heat, sound = _touch(material, options)
            _write(heat, sound, options)
    _report(heat, sound, as_json=options.json)
    return 0


def _report(heat: Heat, sound: Sound, *, as_json: bool) -> None:
    if as_json:
        print(json.dumps({"thermal": asdict(heat), "vibration": sound.describe()}), flush=True)
    else:
        _print(heat, sound.describe())
        sys.stdout.flush()


def _touch(material: Material, options: argparse.Namespace) -> tuple[Heat, Sound]:
    from hapticvlm.materials import MATERIALS
    from hapticvlm.rendering.vibration.vibration import Motion
    from hapticvlm_studio.touches.heat import heat
    from hapticvlm_studio.touches.sound import sound

    usual_mps = SWING_MPS if options.interaction == "swing" else SPEED_MPS
    motion = Motion(usual_mps if options.speed is None else options.speed, options.force)
    # A recording may be of another material than the one that is touched.
    others = {} if options.patterns is None else MATERIALS
    touch = (options.interaction, motion, options.seconds)
    voices = touch_options.voices(options, {**others, material.name: material})
    return (
        heat(material, _thermal_inputs(options), options.seconds),
        sound(material, *touch, voices, options.thickness_m),
    )


def _thermal_inputs(options: argparse.Namespace) -> ThermalInputs:
    from hapticvlm_studio.touches.heat import ThermalInputs

    return ThermalInputs(
        options.object_c,
        options.ambient_c,
        options.skin_c,
        options.contact_resistance,
        options.thickness_m,
    )


def _write(heat: Heat, sound: Sound, options: argparse.Namespace) -> None:
    if options.wav is not None:
        from hapticvlm.rendering.vibration.sound_voice import in_voice
        from hapticvlm_studio.touches.sound import write_wav

        write_wav(options.wav, in_voice(sound.wave, options.voice))
    if options.plot is not None:
        from hapticvlm_studio.touches import plot

        plot.draw(heat, sound, options.plot)


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
