"""What `hapticvlm doctor` checks on cables: audio outputs and plates; none is played or heated.

A plate only exchanges hello, which opening resets, and stays off.
"""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

from hapticvlm.devices.errors import DeviceError
from hapticvlm.devices.plate import ports
from hapticvlm.devices.plate.peltier import Peltier
from hapticvlm.devices.plate.ports import PortInfo
from hapticvlm.devices.speaker.output import OutputError, choose
from hapticvlm.devices.speaker.output_list import AUDIO_S, output_names
from hapticvlm.doctor.findings import Finding, Verdict
from hapticvlm.server.settings import ServeOptions


def audio(options: ServeOptions) -> list[Finding]:
    """Find the outputs, and whether the one asked for is among them."""
    try:
        return [found_audio(options, output_names())]
    except subprocess.TimeoutExpired:
        text = f"the sound system did not answer within {AUDIO_S:g} s"
        verdict: Verdict = "note" if options.speaker == "simulated" else "wrong"
        return [Finding("audio", verdict, text, "is a sound server running? try again")]


def found_audio(options: ServeOptions, names: list[str]) -> Finding:
    """Judge the outputs' names by what was asked for."""
    text = f"outputs: {', '.join(names) or 'none'}"
    if options.speaker == "simulated":
        cure = "--speaker default, or part of a name, plays on one" if names else None
        return Finding("audio", "ok", f"{text}; simulated is asked for", cure)
    try:
        choose([{"name": name} for name in names], options.speaker)
    except OutputError as error:
        cure = "plug one in, start the sound server, or --speaker simulated"
        return Finding("audio", "wrong", f"--speaker {options.speaker}: {error}", cure)
    return Finding("audio", "ok", f"{text}; {options.speaker} is asked for")


def plates(options: ServeOptions) -> list[Finding]:
    """Find which serial ports may be a plate, whether they may be opened, and which answers."""
    is_asked = options.peltier != "simulated"
    try:
        found = ports.candidate_ports(options.peltier if is_asked else ports.AUTO)
    except DeviceError as error:
        verdict: Verdict = "wrong" if is_asked else "ok"
        return [Finding("plate", verdict, str(error).split("; plug")[0], "or --peltier simulated")]
    findings = [_judged(place, is_asked) for place in found]
    if is_asked and any(
        finding.verdict == "ok" for finding in findings
    ):  # auto takes the one that answers
        return [finding for finding in findings if finding.verdict == "ok"]
    return findings


def _judged(place: PortInfo, is_asked: bool) -> Finding:
    if Path(place.url).exists() and not os.access(place.url, os.R_OK | os.W_OK):
        verdict: Verdict = "wrong" if is_asked else "note"
        text = f"{place.text}: may not be opened by you"
        return Finding("plate", verdict, text, _join_group(Path(place.url)))
    return check_plate(place.text, Peltier(place.url), is_asked)


def _join_group(port: Path) -> str:
    return f"sudo usermod -aG {port.group()} $USER, then log in again"


def check_plate(address: str, plate: Peltier, is_asked: bool) -> Finding:
    """Connect to what may be a plate and close it; no setpoint is sent."""
    try:
        plate.connect()
    except DeviceError as error:
        reason = str(error).removeprefix("no plate answered; ")
        cure = "another port, the board's cable, or no firmware yet: hapticvlm plate flash"
        return Finding("plate", "wrong" if is_asked else "note", reason or address, cure)
    finally:
        plate.close()
    return Finding("plate", "ok", f"{plate.name} answers")
