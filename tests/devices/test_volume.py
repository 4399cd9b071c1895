"""Tests that a muted or low output is known, by each system's own words and by a real sink."""

from __future__ import annotations

import subprocess
import threading

import pytest
from each_case import each_row
from null_sink import NAME, null_sink
from pace import until

from hapticvlm.devices.speaker.volume import Volume, VolumeWatch, volume_of

# as pactl 16.1 prints it, shortened
SINKS = """Sink #1
\tState: RUNNING
\tName: alsa_output.usb-dac
\tDescription: USB DAC Analog Stereo
\tMute: no
\tVolume: front-left: 6554 /  10% / -60.00 dB,   front-right: 6554 /  10% / -60.00 dB
\tBase Volume: 65536 / 100% / 0.00 dB
Sink #2
\tName: alsa_output.pci
\tDescription: Built-in Audio
\tMute: yes
\tVolume: mono: 65536 / 100% / 0.00 dB
"""
PROGRAMS = {
    "pactl list": SINKS,
    "pactl info": "Server Name: PulseAudio\nDefault Sink: alsa_output.pci\n",
}
WPCTL = {"wpctl get-volume": "Volume: 0.10 [MUTED]\n"}
MACOS = {"osascript -e": "output volume:6, input volume:50, alert volume:100, output muted:false\n"}


def said(programs: dict[str, str]):
    """A run of the programs of one system."""
    return lambda *command: programs.get(" ".join(command[:2]))


@each_row(
    ("programs", "output", "volume"),
    [
        (PROGRAMS, "USB DAC Analog Stereo", Volume(False, 0.1)),
        (PROGRAMS, "Built-in Audio", Volume(True, 1.0)),
        (PROGRAMS, "default output (PulseAudio)", Volume(True, 1.0)),
        (PROGRAMS, "HDMI", None),
        (WPCTL, "default", Volume(True, 0.1)),
        (WPCTL, "USB DAC", None),
        (MACOS, "default", Volume(False, 0.06)),
        ({}, "default", None),
        ({"pactl list": "Sink #1\n\tName: x\n"}, "x", None),
        ({"osascript -e": "missing value"}, "default", None),
    ],
)
def test_the_volume_is_read_from_what_the_system_prints(
    programs: dict[str, str], output: str, volume: Volume | None
) -> None:
    assert volume_of(output, said(programs)) == volume


def test_only_a_muted_output_and_one_below_a_quarter_are_low() -> None:
    assert Volume(True, 1.0).is_low
    assert Volume(False, 0.24).is_low
    assert not Volume(False, 0.25).is_low


def test_the_watch_follows_a_change_and_ends() -> None:
    answers = [Volume(False, 1.0), Volume(True, 1.0)]
    asked = threading.Semaphore(0)

    def ask(_: str) -> Volume | None:
        asked.release()
        return answers.pop(0) if answers else None

    watch = VolumeWatch("speaker", ask, every_s=0.0)
    until(lambda: not answers and watch.volume is None)
    watch.close()
    until(lambda: "volume" not in [thread.name for thread in threading.enumerate()])


@pytest.mark.process
@pytest.mark.needs_toolchain("pulseaudio")
def test_a_real_sink_that_is_muted_or_turned_down_is_seen() -> None:
    with null_sink():
        assert volume_of(NAME) == Volume(False, 1.0)
        subprocess.run(["pactl", "set-sink-volume", "@DEFAULT_SINK@", "10%"], check=True)
        assert volume_of(NAME) == Volume(False, 0.1)
        subprocess.run(["pactl", "set-sink-mute", "@DEFAULT_SINK@", "1"], check=True)
        assert volume_of(NAME) == volume_of("default") == Volume(True, 0.1)
