"""Checks audio outputs and plates for `hapticvlm doctor`, without playing or heating anything.

A plate only exchanges hello with this program. Opening its port resets the board, which stays off.
"""

from __future__ import annotations

import os
import subprocess
from pathlib import Path
from typing import Any

from hapticvlm.devices.errors import DeviceError
from hapticvlm.devices.plate import ports
from hapticvlm.devices.plate.peltier import Peltier
from hapticvlm.devices.plate.ports import PortInfo
from hapticvlm.devices.speaker.channels import channels_of_hands
from hapticvlm.devices.speaker.output import OutputError, choose
from hapticvlm.devices.speaker.output_list import AUDIO_S, outputs
from hapticvlm.devices.speaker.output_state import output_state
from hapticvlm.devices.worn import table
from hapticvlm.doctor.findings import Finding, Verdict
from hapticvlm.server.settings import ServeOptions


def audio(options: ServeOptions) -> list[Finding]:
    """List the audio outputs, and check whether the chosen one is among them."""
    try:
        return [found_audio(options, outputs())]
    except subprocess.TimeoutExpired:
        message = f"the sound system did not answer within {AUDIO_S:g} s"
        verdict: Verdict = "note" if options.speaker == "simulated" else "wrong"
        return [Finding("audio", verdict, message, "start the sound server, then try again")]


def found_audio(options: ServeOptions, present: list[dict[str, Any]]) -> Finding:
    """Check whether the chosen speaker is among these outputs, and not muted or turned down."""
    names = [output["name"] for output in present]
    listed = f"outputs: {', '.join(names) or 'none'}"
    is_simulated = options.speaker == "simulated"
    if is_simulated and not names:
        return Finding("audio", "ok", f"{listed}; the speaker is simulated", None)
    speaker = "default" if is_simulated else options.speaker
    try:
        chosen = choose(present, speaker)
        hands = channels_of_hands(speaker, options.channels)
    except (OutputError, ValueError) as error:
        absent = "plug one in, start the sound server, or use --speaker simulated"
        return Finding("audio", "wrong", f"--speaker {options.speaker}: {error}", absent)
    name = "default" if chosen is None else chosen.get("system_name") or chosen["name"]
    state = output_state(name, hands=hands)
    if state is not None and state.fault is not None:
        verdict: Verdict = "note" if is_simulated else "wrong"
        message = f"{listed}; the output {speaker} is {state.text}"
        return Finding("audio", verdict, message, state.fault.remedy)
    cure = "use one: --speaker default, or part of its name" if is_simulated else None
    return Finding("audio", "ok", f"{listed}; the speaker is {options.speaker}", cure)


def plates(options: ServeOptions) -> list[Finding]:
    """Check each serial port that may be a plate: whether it can be opened, and whether it answers.

    A fault counts as wrong only where the service is to use a real plate.
    """
    is_required = options.peltier != "simulated"
    try:
        candidates = ports.candidate_ports(options.peltier if is_required else ports.AUTO)
    except ports.UnknownPortsError as error:
        unknown: Verdict = "wrong" if is_required else "note"
        return [Finding("plate", unknown, str(error).split("; opening")[0], ports.NAME_IT)]
    except DeviceError as error:
        verdict: Verdict = "wrong" if is_required else "ok"
        cure = "plug one in, build one (docs/maker.md: 2c is the first), or use --peltier simulated"
        return [Finding("plate", verdict, str(error).split("; plug")[0], cure)]
    findings = [_check_port(place, is_required) for place in candidates]
    answering = [finding for finding in findings if finding.verdict == "ok"]
    if is_required and answering:  # `auto` uses the plate that answers
        return answering
    return findings


def worn(options: ServeOptions) -> list[Finding]:
    """Name each output that people own whose program answers: on this machine, or at `--hand`."""
    named = [] if options.hand is None else options.hand.split(",")
    asked = {option.partition("=")[0]: option for option in (*table.WORN, *named)}
    answers = {name: answer for name, option in asked.items() if (answer := table.answers(option))}
    cure = None if named else f"drive it: --hand {','.join(answers)}"
    return [Finding(name, "ok", answer, cure) for name, answer in answers.items()]


def _check_port(place: PortInfo, is_required: bool) -> Finding:
    if Path(place.url).exists() and not os.access(place.url, os.R_OK | os.W_OK):
        verdict: Verdict = "wrong" if is_required else "note"
        message = f"{place.text}: you have no permission to open it"
        return Finding("plate", verdict, message, _join_group(Path(place.url)))
    return check_plate(place.text, Peltier(place.url), is_required)


def _join_group(port: Path) -> str:
    return f"sudo usermod -aG {port.group()} $USER, then log in again"


def check_plate(address: str, plate: Peltier, is_required: bool) -> Finding:
    """Connect to a possible plate and close it again; no setpoint is sent."""
    try:
        plate.connect()
    except DeviceError as error:
        reason = str(error).removeprefix("no plate answered; ")
        cure = "try another port, check the cable, or write its firmware: hapticvlm plate flash"
        return Finding("plate", "wrong" if is_required else "note", reason or address, cure)
    finally:
        plate.close()
    return Finding("plate", "ok", f"{plate.name} answers")
