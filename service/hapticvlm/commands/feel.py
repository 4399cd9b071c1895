"""`hapticvlm feel`: computes what a touch of a material feels like, without scene or service."""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hapticvlm import documents
from hapticvlm.commands import touch_options
from hapticvlm.commands.parsing import add_json, number_within
from hapticvlm.errors import UsageError, usage_errors
from hapticvlm.rendering.touch_ranges import RANGES
from hapticvlm.rendering.vibration.vibration import INTERACTIONS
from hapticvlm.touches import GLOVE, OWNED

if TYPE_CHECKING:
    from hapticvlm.commands.parsing import Commands
    from hapticvlm.materials import Material
    from hapticvlm.touches.felt import FeltTouch
    from hapticvlm.touches.heat import Heat

    Table = Mapping[str, Material]

SHOWN_S = (0.0, 0.1, 0.25, 0.5, 1.0, 2.0, 5.0, 10.0)
ALL = "all"
PAGE, DRAWING = ".html", ".svg"
HEARD = (".wav", PAGE)  # the others are drawn, or drive an actuator
ENDINGS = (DRAWING, *HEARD, ".haptic", ".ahap")
SCALES = ("palm", "controller")

_DESCRIPTION = """
Compute what touching a material feels like. The command prints the temperature of the skin, the
setpoint of the plate, the limit that acted, and the vibration. It uses neither a service nor a
device. In Python `hapticvlm.feel` is the same. The ending of a FILE to save chooses its format. A
.svg is a drawing, and a .wav is what the palm speaker plays. Other tools read .haptic (Meta Haptics
SDK) and .ahap (Apple Core Haptics). A .html is a page to hear and compare touches, with the files
to download. Beside .wav, .haptic and .ahap a second file (FILE.heat.json) has the temperatures.
"""


def add(commands: Commands) -> None:
    """Declare the command and its options."""
    feel = commands.add_parser(
        "feel",
        help="compute what a touch feels like, and save it",
        description=_DESCRIPTION,
        examples=(
            "hapticvlm feel metal --object-c 5",
            "hapticvlm feel wood slide --speed 0.2 --save wood.svg --save wood.wav",
            "hapticvlm feel glass tap --save glass.haptic --scale controller",
            "hapticvlm feel all --save touches.html",
        ),
    )
    feel.set_defaults(run=_feel)
    feel.add_argument(
        "material",
        metavar="MATERIAL",
        help=f"material, such as wood, glass, fabric or metal; `{ALL}` for a page of all",
    )
    feel.add_argument(
        "interaction",
        nargs="?",
        choices=INTERACTIONS,
        help="how the hand touches (a strike, then a slide from 0.4 s on; a page has all of them)",
    )
    _add_touch(feel)
    out = feel.add_argument_group("output")
    out.add_argument(
        "--save",
        type=Path,
        action="append",
        default=[],
        metavar="FILE",
        help=f"write the touch to this file ({', '.join(ENDINGS)}); may be given several times",
    )
    out.add_argument(
        "--scale",
        choices=SCALES,
        default=SCALES[0],
        help="strength in .haptic and .ahap: as the palm speaker plays it, or as "
        "controllers and phones need it (%(default)s)",
    )
    out.add_argument(
        "--on",
        choices=OWNED,
        help="what an output that you own plays of the touch, in print, .wav and .svg; "
        "`weart` is told as the texts for the glove",
    )
    touch_options.add_voice(out, None, "voice of .wav (true), or in which a page plays (sound)")
    add_json(out)


def _add_touch(feel: argparse.ArgumentParser) -> None:
    touch = feel.add_argument_group("touch")
    touch.add_argument(
        "--object-c",
        type=number_within(*RANGES["object_c"]),
        metavar="DEGC",
        help="temperature of the object (22, that of the room)",
    )
    touch.add_argument(
        "--speed",
        type=number_within(*RANGES["speed_mps"]),
        metavar="M_PER_S",
        help="highest speed of a stroke, or speed of an impact, in m/s (0.3; swing 5)",
    )
    touch.add_argument(
        "--force",
        type=number_within(*RANGES["force_n"]),
        default=1.0,
        metavar="N",
        help="force of the hand in N (%(default)s)",
    )
    touch.add_argument(
        "--seconds",
        type=number_within(*RANGES["seconds"]),
        metavar="S",
        help="length of the touch (5; in a page 1)",
    )
    touch_options.add_recordings(touch)
    touch_options.add_gallery(touch)


def _feel(options: argparse.Namespace) -> int:
    from hapticvlm.commands.progress import working
    from hapticvlm.materials import find

    _check(options)
    with usage_errors(), working("computing the touch"):
        table = touch_options.table(options.gallery)
        if options.material == ALL:
            written = [_save_page(path, table.values(), options, table) for path in options.save]
            touch = None
        else:
            touch = _touch(find(options.material, table), options.interaction, options, table)
            written = [line for path in options.save for line in _save(touch, path, options, table)]
    if touch is not None and options.json:
        print(json.dumps(_document(touch, is_glove=options.on == GLOVE)))
        return 0
    if touch is not None:
        _print_heat(touch.heat)
        print(_vibration(touch, is_glove=options.on == GLOVE))
    for line in written:
        print(line)
    return 0


def _check(options: argparse.Namespace) -> None:
    """Refuse files of no known format, and options that would do nothing. Raises UsageError."""
    endings = {path.suffix.lower() for path in options.save}
    for path in options.save:
        if path.suffix.lower() not in ENDINGS:
            raise UsageError(f"--save {path}: choose one of the endings {', '.join(ENDINGS)}")
    if options.voice is not None and not endings & set(HEARD):
        raise UsageError(f"--voice is for --save FILE with the ending {' or '.join(HEARD)}")
    if options.on is not None and (options.material == ALL or not endings <= {DRAWING, ".wav"}):
        raise UsageError(f"--on is for one touch, printed or saved as .wav or {DRAWING}")
    if options.on == GLOVE and options.save:
        raise UsageError(f"--on {GLOVE}: the glove plays textures of its own; leave out --save")
    if options.material == ALL and (options.json or endings != {PAGE}):
        raise UsageError(f"`{ALL}` is for a page of touches: give --save FILE{PAGE} and no --json")


def _touch(
    material: Material,
    interaction: str | None,
    options: argparse.Namespace,
    table: Table,
    seconds: float = 5.0,
) -> FeltTouch:
    from hapticvlm.touches.felt import feel

    # A recording may be of another material than the one that is touched.
    others = {} if options.patterns is None else table
    touch = feel(
        material,
        interaction,
        object_c=options.object_c,
        speed_mps=options.speed,
        force_n=options.force,
        seconds=seconds if options.seconds is None else options.seconds,
        voices=touch_options.voices(options, {**others, material.name: material}),
    )
    return touch if options.on is None else touch.on(options.on)


def _save(touch: FeltTouch, path: Path, options: argparse.Namespace, table: Table) -> list[str]:
    """Write the touch to a file; return a line for each file written."""
    ending = path.suffix.lower()
    if ending == PAGE:
        return [_save_page(path, [touch.sound.material], options, table)]
    if ending == DRAWING:
        touch.plot().save(path)
        return [str(path)]
    voice = (options.voice if ending == ".wav" else None) or "true"
    return [str(written) for written in touch.save(path, scale=options.scale, voice=voice)]


def _save_page(
    path: Path, materials: Iterable[Material], options: argparse.Namespace, table: Table
) -> str:
    """Write the page of these materials; return a line that says so."""
    from hapticvlm.touches import gallery

    interactions = INTERACTIONS if options.interaction is None else (options.interaction,)
    clips = [
        _touch(material, interaction, options, table, 1.0).clip(options.scale)
        for material in materials
        for interaction in interactions
    ]
    documents.replace_file(path, gallery.page(clips, options.voice or "sound"))
    return f"{path}: {len(clips)} touches, {path.stat().st_size / 1e6:.1f} MB; open it in a browser"


def _document(touch: FeltTouch, *, is_glove: bool) -> dict[str, Any]:
    felt = {"texts": _glove_texts(touch)} if is_glove else {"vibration": touch.sound.describe()}
    return {"thermal": asdict(touch.heat), **felt}


def _glove_texts(touch: FeltTouch) -> list[str]:
    from hapticvlm.touches.owned import glove_texts

    return glove_texts(touch.sound, touch.heat)


def _print_heat(heat: Heat) -> None:
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


def _vibration(touch: FeltTouch, *, is_glove: bool) -> str:
    if is_glove:
        return "\n".join(("", *_glove_texts(touch)))
    vibration = touch.sound.describe()
    levels = vibration["spectrum"]["level_db"]
    loudest_hz = vibration["spectrum"]["frequency_hz"][levels.index(max(levels))]
    modes = ", ".join(f"{mode['frequency_hz']:g} Hz" for mode in vibration["modes"])
    rms_db = 20.0 * math.log10(max(vibration["rms"], 1e-8))
    return (
        f"\n{vibration['interaction']}: modes {modes}; texture {vibration['texture_hz']:.0f} Hz\n"
        f"peak {vibration['peak']:.2f}, level {rms_db:.0f} dB re full scale, strongest near "
        f"{loudest_hz:.0f} Hz, {100 * vibration['share_1_to_1000_hz']:.1f} % within 1-1000 Hz"
    )
