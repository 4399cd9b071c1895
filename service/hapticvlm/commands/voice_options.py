"""Options of what is played instead of, or corrected for a speaker: recordings and a response."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import argparse

    from hapticvlm.materials import Material
    from hapticvlm.rendering.patterns import Pattern
    from hapticvlm.rendering.voices import Voices


def add_options(parser: argparse.ArgumentParser | argparse._ArgumentGroup) -> None:
    """Declare both, as `serve` has them."""
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
    from hapticvlm.devices.pattern_folder import read_patterns
    from hapticvlm.devices.response import read_response
    from hapticvlm.rendering.equaliser import Correction, Playback
    from hapticvlm.rendering.voices import Voices

    correction = Correction()
    if options.speaker_response is not None:
        correction = read_response(options.speaker_response).correction()
    patterns: tuple[Pattern, ...] = ()
    if options.patterns is not None:
        patterns = read_patterns(options.patterns, table, correction)
    return Voices(1.0, table, Playback(correction=correction), patterns)
