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
        with subprocess.Popen(["pacat", "--playback", "/dev/zero"]) as player:
            until(lambda: _pactl("list", "sink-inputs").count(f'"{player.pid}"') == 1)
            number = _pactl("list", "short", "sink-inputs").split()[0]
            for command, heard in (("volume", Volume(False, 0.1)), ("mute", Volume(True, 0.1))):
                _pactl(f"set-sink-input-{command}", number, "10%" if command == "volume" else "1")
                assert volume_of(NAME, pid=player.pid) == heard
            assert volume_of(NAME) == Volume(False, 1.0)
            player.kill()
        _pactl("set-sink-volume", "@DEFAULT_SINK@", "10%")
        assert volume_of(NAME) == Volume(False, 0.1)
        _pactl("set-sink-mute", "@DEFAULT_SINK@", "1")
        assert volume_of(NAME) == volume_of("default") == Volume(True, 0.1)


def _pactl(*words: str) -> str:
    return subprocess.run(["pactl", *words], check=True, capture_output=True, text=True).stdout
