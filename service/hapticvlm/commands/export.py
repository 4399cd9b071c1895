"""`hapticvlm export`: writes a touch of a material as a file for other haptic tools."""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from hapticvlm.commands import touch_options
from hapticvlm.commands.parsing import number_within
from hapticvlm.errors import UsageError, usage_errors
from hapticvlm.rendering.touch_ranges import RANGES
from hapticvlm.rendering.vibration.vibration import INTERACTIONS

if TYPE_CHECKING:
    from hapticvlm.commands.parsing import Commands
    from hapticvlm.materials import Material
    from hapticvlm.touches.clip import Clip

PAGE = "page"
FORMATS = ("wav", "haptic", "ahap", "hjif", PAGE)
SCALES = ("palm", "controller")
ALL = "all"
_DESCRIPTION = """
Write what touching a material feels like to a file. Formats are wav (what the palm speaker plays),
haptic (Meta Haptics SDK), ahap (Apple Core Haptics) or hjif (MPEG, ISO/IEC 23090-31). `all` writes
every material of the table and of --gallery into the folder --out, one file for each interaction.
The file hjif contains the temperature of the plate; for the other formats it is written to a second
file (.heat.json). `page` is one HTML file to hear and compare touches, with all four formats to
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
        type=number_within(*RANGES["speed_mps"]),
        metavar="M_PER_S",
        help="speed of the hand in m/s (0.3; swing 5)",
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
    from hapticvlm.touches.felt import save_clip

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
        folder = options.out if options.material == ALL and options.out is not None else Path()
        if options.voice == "sound":
            clip = _as_sound(clip)
        path = job.path or folder / f"{clip.name}.{options.to}"
        written = save_clip(clip, options.to, path)
        print("  ".join(map(str, written)), flush=True)
    return 0


def _write_page(
    jobs: list[_Job], options: argparse.Namespace, table: Mapping[str, Material]
) -> int:
    from hapticvlm.touches import gallery

    if options.material != ALL and options.interaction is None:
        jobs = [_Job(job.material, touch, job.path) for job in jobs for touch in INTERACTIONS]
    with usage_errors():
        clips = [_clip(job, options, table) for job in jobs]
    path = options.out or Path(f"{options.material}.html")
    path.write_text(gallery.page(clips, options.voice or "sound"), encoding="utf-8")
    print(f"{path}: {len(clips)} touches, {path.stat().st_size / 1e6:.1f} MB; open it in a browser")
    return 0


def _jobs(options: argparse.Namespace, table: Mapping[str, Material]) -> Iterator[_Job]:
    from hapticvlm.materials import find

    if options.material != ALL:
        yield _Job(find(options.material, table), options.interaction, options.out)
        return
    if options.to != PAGE and options.out is not None and options.out.is_file():
        raise UsageError(f"--out {options.out} is a file; `{ALL}` needs a folder")
    interactions = INTERACTIONS if options.interaction is None else (options.interaction,)
    for material in table.values():
        for interaction in interactions:
            yield _Job(material, interaction, None)


def _clip(job: _Job, options: argparse.Namespace, table: Mapping[str, Material]) -> Clip:
    from hapticvlm.touches.felt import feel

    # A recording may be of another material than the one that is touched.
    others = {} if options.patterns is None else table
    touch = feel(
        job.material,
        job.interaction,
        object_c=options.object_c,
        ambient_c=options.ambient_c,
        speed_mps=options.speed,
        force_n=options.force,
        seconds=options.seconds,
        voices=touch_options.voices(options, {**others, job.material.name: job.material}),
    )
    return touch.clip(options.scale)


def _as_sound(clip: Clip) -> Clip:
    from hapticvlm.rendering.vibration.sound_voice import as_sound

    return replace(clip, wave=as_sound(clip.wave))
