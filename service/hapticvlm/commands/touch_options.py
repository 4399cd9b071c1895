"""Options that several commands of touches share: the voice, materials and recordings of a user."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from hapticvlm.errors import why_no_folder
from hapticvlm.rendering.vibration.vibration import VOICES

if TYPE_CHECKING:
    from hapticvlm.materials import Material
    from hapticvlm.rendering.vibration.voices import Voices

Options = argparse.ArgumentParser | argparse._ArgumentGroup


def add_voice(parser: Options, default: str | None, what: str) -> None:
    """Declare the voice in which `what` is heard; None leaves the default to the command."""
    parser.add_argument(
        "--voice",
        choices=VOICES,
        default=default,
        help=f"{what}: `true` is what the palm speaker plays, mostly below 300 Hz; `sound` the "
        "same touch moved to where ears and small speakers hear it",
    )


def add_gallery(parser: Options) -> None:
    """Declare the folder of the user's own materials."""
    parser.add_argument(
        "--gallery", type=Path, metavar="GALLERY", help="folder with materials of your own"
    )


def table(gallery: Path | None) -> Mapping[str, Material]:
    """Return the table of materials, with the user's own. Raises OSError, ValueError."""
    from hapticvlm.materials import MATERIALS
    from hapticvlm.vision.galleries.user_materials import read_folder, table_with

    if gallery is None:
        return MATERIALS
    if not gallery.is_dir() and gallery.suffix != ".npz":  # an .npz has no materials of its own
        raise ValueError(f"--gallery {why_no_folder(gallery)}; give a folder of materials")
    return table_with(read_folder(gallery))


def add_recordings(parser: Options) -> None:
    """Declare recordings to play instead of synthesis, and the correction of the speaker."""
    parser.add_argument(
        "--patterns",
        type=Path,
        metavar="FOLDER",
        help="play the recordings of this folder instead of synthesis, as `serve` does",
    )
    parser.add_argument(
        "--speaker-response",
        type=Path,
        metavar="FILE",
        help="correct the speaker with this curve, as `serve` does",
    )


def voices(options: argparse.Namespace, table: Mapping[str, Material]) -> Voices:
    """Return the mixer that the options describe. Raises OSError, ValueError."""
    from hapticvlm.devices.speaker.speaker_files import read_speaker_files
    from hapticvlm.rendering.vibration.voices import Voices

    files = (options.speaker_response, options.patterns)
    playback, patterns = read_speaker_files(*files, table)
    return Voices(1.0, table, playback, patterns)
