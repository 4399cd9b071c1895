"""`hapticvlm export`: writes a touch of a material as a file for other haptic tools."""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hapticvlm.commands import touch_options
from hapticvlm.commands.parsing import number_within
from hapticvlm.errors import UsageError, usage_errors
from hapticvlm.rendering.vibration.vibration import INTERACTIONS

if TYPE_CHECKING:
    from hapticvlm.commands.parsing import Commands
    from hapticvlm.materials import Material
    from hapticvlm_studio.touches.clip import Clip

PAGE = "page"
FORMATS = ("wav", "haptic", "ahap", "hjif", PAGE)
SCALES = ("palm", "controller")
ALL = "all"
HEAT_SUFFIX = ".heat.json"
_DESCRIPTION = """
Write what touching a material feels like to a file: wav (48 kHz, what the palm speaker plays),
haptic (Meta Haptics SDK), ahap (Apple Core Haptics) or hjif (MPEG, ISO/IEC 23090-31). `all` writes
every material of the table and of --gallery into the folder --out, one file for each interaction.
hjif contains the temperature of the plate; for the other formats it is written to a second file
(.heat.json). `page` is one HTML file to hear and compare touches, with all four formats to
download. `--scale controller` raises what a controller or a phone would hardly play; wav files do
not change.
"""


def add(commands: Commands) -> None:
    """Declare the command and its options."""
    export = commands.add_parser(
        "export", help="write a touch for other haptic tools", description=_DESCRIPTION
    )
    export.set_defaults(run=_export)
    export.add_argument("material", metavar="MATERIAL", help=f"material, such as wood, or {ALL}")
    export.add_argument("--to", required=True, choices=FORMATS, help="format to write")
    export.add_argument(
        "--interaction", choices=INTERACTIONS, help="how the hand touches (a strike, then a slide)"
    )
    export.add_argument(
        "--out", type=Path, metavar="PATH", help="file, or folder for all (MATERIAL-...)"
    )
    export.add_argument(
        "--speed",
        type=number_within(0.0, 20.0),
        default=0.3,
        metavar="M_PER_S",
        help="speed of the hand in m/s (0.3)",
    )
    export.add_argument(
        "--scale",
        choices=SCALES,
        default=SCALES[0],
        help="strength: as the palm speaker plays it, or as controllers and phones need it (palm)",
    )
    touch_options.add_voice(
        export, None, "voice of a wav file (true), or in which a page plays (sound)"
    )
    touch_options.add_force(export)
    touch_options.add_seconds(export, 1.0)
    touch_options.add_temperatures(export)
    touch_options.add_gallery(export)
    touch_options.add_recordings(export)


@dataclass(frozen=True, slots=True)
class _Job:
    """One file to write."""

    material: Material
    interaction: str | None
    path: Path | None  # None: the folder, and the name of the touch


def _export(options: argparse.Namespace) -> int:
    if options.voice is not None and options.to not in ("wav", PAGE):
        raise UsageError(f"--voice is for wav and page; {options.to} drives an actuator")
    with usage_errors():
        table = touch_options.table(options.gallery)
        jobs = list(_jobs(options, table))
    if options.to == PAGE:
        return _write_page(jobs, options, table)
    if options.material == ALL and options.out is not None:
        options.out.mkdir(parents=True, exist_ok=True)
    for job in jobs:
        with usage_errors():
            clip = _clip(job, options, table)
        if options.scale == "controller":
            clip = _for_controllers(clip)
        folder = options.out if options.material == ALL and options.out is not None else Path()
        if options.voice == "sound":
            clip = _as_sound(clip)
        path = job.path or folder / f"{clip.name}.{options.to}"
        print("  ".join(str(written) for written in write(clip, options.to, path)), flush=True)
    return 0


def _write_page(
    jobs: list[_Job], options: argparse.Namespace, table: Mapping[str, Material]
) -> int:
    from hapticvlm_studio.touches import gallery

    if options.material != ALL and options.interaction is None:
        jobs = [_Job(job.material, touch, job.path) for job in jobs for touch in INTERACTIONS]
    with usage_errors():
        clips = [_clip(job, options, table) for job in jobs]
    clips = [_for_controllers(clip) for clip in clips] if options.scale != SCALES[0] else clips
    path = options.out or Path(f"{options.material}.html")
    path.write_text(gallery.page(clips, options.voice or "sound"), encoding="utf-8")
    print(f"{path}: {len(clips)} touches, {path.stat().st_size / 1e6:.1f} MB; open it in a browser")
    return 0


def write(clip: Clip, kind: str, path: Path) -> list[Path]:
    """Write a clip, and its temperatures to a second file where the format has none.

    Returns the paths written. Raises OSError.
    """
    from hapticvlm_studio.touches import ahap, haptic, hjif
    from hapticvlm_studio.touches.sound import write_wav

    if kind == "hjif":
        _write_json(path, hjif.document(clip, time.strftime("%Y-%m-%d")))
        return [path]
    if kind == "wav":
        write_wav(path, clip.wave)
    else:
        _write_json(path, haptic.document(clip) if kind == "haptic" else ahap.document(clip))
    heat_path = path.with_name(path.name + HEAT_SUFFIX)
    _write_json(heat_path, heat_document(clip))
    return [path, heat_path]


def heat_document(clip: Clip) -> dict[str, Any]:
    """Return the temperatures of a touch from contact on, in degC, times in s."""
    heat = clip.heat
    return {
        "material": heat.material,
        "surface_c": heat.surface_c,
        "contact_c": round(heat.contact_c, 2),
        "time_s": heat.time_s,
        "skin_c": [round(celsius, 2) for celsius in heat.skin_c],
        "setpoint_c": [round(celsius, 2) for celsius in heat.setpoint_c],
    }


def _jobs(options: argparse.Namespace, table: Mapping[str, Material]) -> Iterator[_Job]:
    if options.material != ALL:
        yield _Job(touch_options.find(options.material, table), options.interaction, options.out)
        return
    if options.to != PAGE and options.out is not None and options.out.is_file():
        raise UsageError(f"--out {options.out} is a file; `{ALL}` needs a folder")
    interactions = INTERACTIONS if options.interaction is None else (options.interaction,)
    for material in table.values():
        for interaction in interactions:
            yield _Job(material, interaction, None)


def _clip(job: _Job, options: argparse.Namespace, table: Mapping[str, Material]) -> Clip:
    from hapticvlm.rendering.vibration.vibration import Motion
    from hapticvlm_studio.touches.clip import clip
    from hapticvlm_studio.touches.heat import ThermalInputs, heat
    from hapticvlm_studio.touches.sound import sound

    # A recording may be of another material than the one that is touched.
    others = {} if options.patterns is None else table
    voices = touch_options.voices(options, {**others, job.material.name: job.material})
    motion = Motion(options.speed, options.force)
    return clip(
        sound(job.material, job.interaction, motion, options.seconds, voices),
        heat(job.material, ThermalInputs(options.object_c, options.ambient_c), options.seconds),
    )


def _for_controllers(clip: Clip) -> Clip:
    from hapticvlm_studio.touches.clip import for_controllers

    return for_controllers(clip)


def _as_sound(clip: Clip) -> Clip:
    from hapticvlm.rendering.vibration.sound_voice import as_sound

    return replace(clip, wave=as_sound(clip.wave))


def _write_json(path: Path, document: dict[str, Any]) -> None:
    path.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
