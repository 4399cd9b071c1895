"""What `feel` and `export` share of a touch without a scene: material, warmth, recordings."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from hapticvlm.commands.parsing import number_within

if TYPE_CHECKING:
    from hapticvlm.materials import Material
    from hapticvlm.rendering.vibration.voices import Voices

Options = argparse.ArgumentParser | argparse._ArgumentGroup


def add_force(parser: Options) -> None:
    """Declare how hard the hand touches."""
    parser.add_argument(
        "--force",
        type=number_within(0.0, 100.0),
        default=1.0,
        metavar="N",
        help="force of the hand in N (%(default)s)",
    )


def add_temperatures(parser: Options) -> None:
    """Declare how warm object and room are."""
    parser.add_argument(
        "--object-c",
        type=number_within(-100.0, 400.0),
        metavar="DEGC",
        help="temperature of the object (that of the room)",
    )
    parser.add_argument(
        "--ambient-c",
        type=number_within(-60.0, 80.0),
        default=22.0,
        metavar="DEGC",
        help="temperature of the room (%(default)s)",
    )


def add_seconds(parser: Options, default_s: float) -> None:
    """Declare how long the touch lasts."""
    parser.add_argument(
        "--seconds",
        type=number_within(0.02, 60.0),
        default=default_s,
        metavar="S",
        help="how long the touch lasts (%(default)s)",
    )


def add_gallery(parser: Options) -> None:
    """Declare where the user's own materials are."""
    parser.add_argument(
        "--gallery", type=Path, metavar="GALLERY", help="folder with materials of your own"
    )


def table(gallery: Path | None) -> Mapping[str, Material]:
    """Return the materials there are. Raises OSError, ValueError."""
    from hapticvlm.materials import MATERIALS
    from hapticvlm.vision.galleries.user_materials import read_folder, table_with

    return MATERIALS if gallery is None else table_with(read_folder(gallery))


def find(name: str, known: Mapping[str, Material]) -> Material:
    """Find a material by name; raises MaterialError naming the nearest."""
    from hapticvlm.materials import MaterialError, nearest

    found = known.get(name) or known.get(name.lower())
    if found is None:
        raise MaterialError(f"no material `{name[:40]}`{nearest(name, known)}")
    return found


def add_recordings(parser: Options) -> None:
    """Declare what is played instead of synthesis, and the speaker it is corrected for."""
    parser.add_argument(
        "--patterns",
        type=Path,
        metavar="FOLDER",
        help="play the WAV files of this folder instead of synthesis, as `serve` does",
    )
    parser.add_argument(
        "--speaker-response",
        type=Path,
        metavar="FILE",
        help="correct the speaker by this curve, as `serve` does",
    )


def voices(options: argparse.Namespace, table: Mapping[str, Material]) -> Voices:
    """Make the mixer that the options describe. Raises OSError, ValueError."""
    from hapticvlm.devices.speaker.speaker_files import read_speaker_files
    from hapticvlm.rendering.vibration.equaliser import Playback
    from hapticvlm.rendering.vibration.voices import Voices

    files = (options.speaker_response, options.patterns)
    correction, patterns = read_speaker_files(*files, table)
    return Voices(1.0, table, Playback(correction=correction), patterns)
