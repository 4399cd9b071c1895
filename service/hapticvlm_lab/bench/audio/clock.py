"""The virtual clock's underruns in a held slide, beside those of a bare loop and of the host."""

from __future__ import annotations

import time
from typing import Any

from hapticvlm.devices.speaker.engine import AudioSettings
from hapticvlm.devices.speaker.speaker import Speaker
from hapticvlm.rendering.vibration.vibration import Motion
from hapticvlm.rendering.vibration.voices import Command
from hapticvlm_lab.bench.audio.conditions import stolen_s
from hapticvlm_lab.bench.rigs import helper, report_of


def underruns(seconds: float, *, realtime: bool) -> dict[str, Any]:
    """Count the virtual clock's underruns in a held slide, beside those of a bare loop."""
    settings = AudioSettings(realtime=realtime)
    speaker = Speaker(settings)
    speaker.start()
    started = time.monotonic()
    stolen_before = stolen_s()
    try:
        with helper("audio.deadlines", seconds, settings.block, int(realtime)) as bare:
            while time.monotonic() - started < seconds:
                speaker.play(command("slide", 1, 0.5))
                time.sleep(0.1)
            status = speaker.status()
            floor = report_of(bare)
    finally:
        speaker.close()
    counts = {"underruns": status.underruns, "samples": status.samples, "lost": status.lost}
    stolen = stolen_s()
    lost_s = None if stolen is None or stolen_before is None else round(stolen - stolen_before, 2)
    lengths = {"seconds": seconds, "stolen_s": lost_s}
    return {**lengths, **counts, "realtime": status.realtime, "floor": floor}


def line(clock: dict[str, Any]) -> str:
    """Return it in words."""
    ours = clock["underruns"]
    bare = clock["floor"]["missed"]
    text = f"virtual clock, {clock['seconds']:.0f} s: {ours} underruns; a bare loop missed {bare}"
    stolen = clock["stolen_s"]
    return text if stolen is None else f"{text}; the host took {stolen:g} s from this machine"


def command(interaction: str, seed: int, lease_s: float) -> Command:
    """Make what a hand on wood does."""
    return Command(
        hand=1,
        material="wood",
        interaction=interaction,
        onset=interaction == "strike",
        motion=Motion(0.5, 2.0),
        seed=seed,
        expires_at=time.monotonic() + lease_s,
    )
