"""`hapticvlm calibrate speaker`: measures a speaker, so that it can be corrected."""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path
from typing import TYPE_CHECKING

from hapticvlm.commands.parsing import add_json, number_within
from hapticvlm.errors import UsageError, shell_word, usage_errors
from hapticvlm_studio.commands import calibrate_hand

if TYPE_CHECKING:
    from hapticvlm.commands.parsing import Commands
    from hapticvlm.devices.speaker.speaker_files import SpeakerResponse

COUNTDOWN_S = 5  # in which a recording is started and a palm laid on the speaker
_DESCRIPTION = """
Measure how a speaker moves, in two steps. First --speaker NAME plays a sweep of eleven seconds.
Rest a palm on the speaker, and set the level you will use. Record the motion with an accelerometer,
to a WAV file or to a CSV file of time and values, as phones export it. Ctrl-C ends the sweep. Then
--recorded FILE --out CURVE writes the curve that `hapticvlm serve --speaker-response CURVE`
corrects. Without an accelerometer, --by-hand asks for three minutes which of two moments vibrates:
answer 1 or 2, 0 for neither, or q to stop. Wear headphones with noise, so that hearing the speaker
does not help. --simulate measures a simulated speaker or hand.
"""


def add(subjects: Commands) -> None:
    """Declare `calibrate speaker`."""
    speaker = subjects.add_parser(
        "speaker",
        help="measure a speaker, from a recorded sweep or by hand",
        description=_DESCRIPTION,
        examples=(
            "hapticvlm calibrate speaker --speaker default --level 0.3",
            "hapticvlm calibrate speaker --recorded sweep.csv --out curve.csv",
            "hapticvlm calibrate speaker --speaker default --by-hand --out hand.toml",
        ),
    )
    speaker.set_defaults(run=_speaker)
    steps = speaker.add_mutually_exclusive_group(required=True)
    steps.add_argument(
        "--speaker",
        metavar="NAME",
        help="play on `default`, `jack`, or an output of this name",
    )
    steps.add_argument(
        "--recorded", type=Path, metavar="FILE", help="evaluate this recording of the sweep"
    )
    steps.add_argument(
        "--simulate", action="store_true", help="measure a simulated speaker or hand"
    )
    speaker.add_argument(
        "--level",
        type=number_within(0.01, 1.0),
        default=0.5,
        metavar="SHARE",
        help="level of the sweep, 0.01 to 1 of full scale (%(default)s)",
    )
    speaker.add_argument(
        "--by-hand", action="store_true", help="ask what a palm feels; needs no accelerometer"
    )
    speaker.add_argument("--out", type=Path, metavar="FILE", help="write the curve to this file")
    add_json(speaker)


def _speaker(options: argparse.Namespace) -> int:
    with usage_errors():
        if options.by_hand:
            if options.recorded is not None:
                raise UsageError("--by-hand and --recorded: give one of them")
            return calibrate_hand.run(options)
        if options.speaker is not None:
            return _play_sweep(options)
        return _report(_measure(options), options)


def _play_sweep(options: argparse.Namespace) -> int:
    from hapticvlm.rendering.vibration.vibration import RATE_HZ
    from hapticvlm_studio.calibration import output as calibration_output
    from hapticvlm_studio.calibration import speaker_response

    wave = speaker_response.sweep() * (options.level / speaker_response.LEVEL)
    with calibration_output.open_player(options.speaker) as player:
        print(f"{player.name}: start recording, palm on the speaker; Ctrl-C stops", flush=True)
        for left in range(COUNTDOWN_S, 0, -1):
            print(f"  {left}", flush=True)
            time.sleep(1.0)
        player.play(wave)
    seconds = wave.size / RATE_HZ
    print(f"played {seconds:g} s at level {options.level:g}; now run with --recorded FILE")
    return 0


def _measure(options: argparse.Namespace) -> SpeakerResponse:
    from hapticvlm.devices.speaker.audio import read_wav
    from hapticvlm.rendering.vibration.vibration import RATE_HZ
    from hapticvlm_studio.calibration import speaker_response

    if options.simulate:
        moved = speaker_response.simulated_speaker(speaker_response.sweep().astype("float64"))
        return speaker_response.response(moved, RATE_HZ, simulated=True)
    if options.recorded.suffix.lower() == ".csv":
        recording = speaker_response.read_csv(options.recorded)
        if not options.json:
            print(f"{recording.column}, {recording.rate_hz:.0f} Hz")
        return speaker_response.response(recording.values, recording.rate_hz)
    sound, rate = read_wav(options.recorded, speaker_response.LONGEST_S)
    return speaker_response.response(sound.mean(axis=1), rate)


def _report(response: SpeakerResponse, options: argparse.Namespace) -> int:
    from hapticvlm.devices.speaker.speaker_files import write_response

    if options.out is not None:
        write_response(options.out, response)
    if not options.json:
        _print_curve(response)
        if options.out is not None:
            print(f"to use it: hapticvlm serve --speaker-response {shell_word(options.out)}")
        return 0
    result = {"calibrate": "speaker", "simulated": response.simulated}
    result |= {"frequency_hz": [round(hz, 2) for hz in response.frequency_hz]}
    result |= {"response_db": [round(db, 2) for db in response.response_db]}
    print(json.dumps(result))
    return 0


def _print_curve(response: SpeakerResponse) -> None:
    correction = response.correction()
    gains_db = dict(zip(correction.frequency_hz, correction.gain_db, strict=True))
    if response.simulated:
        print("simulated: this curve is only a rehearsal, do not use it")
    print(f"{'Hz':>8} {'response, dB':>13} {'correction, dB':>15}")
    for hz, db in zip(response.frequency_hz, response.response_db, strict=True):
        gain_db = gains_db.get(hz)
        print(f"{hz:>8.1f} {db:>13.1f} {'-' if gain_db is None else f'{gain_db:.1f}':>15}")
