"""Tests that a silent output is known, by each system's own words and by a real sink."""

from __future__ import annotations

import subprocess
import threading
from dataclasses import replace

import pytest
from each_case import each_row
from null_sink import KINDS, NAME, null_sink
from pace import PACE, until

from hapticvlm.devices.faults import SPEAKER_LOW, SPEAKER_UNREACHED
from hapticvlm.devices.speaker.channels import Channels
from hapticvlm.devices.speaker.output_state import OutputState, OutputWatch, output_state
from hapticvlm.doctor import devices
from hapticvlm.server.settings import ServeOptions

# as pactl 16.1 prints it, shortened
SINKS = """Sink #1
\tState: RUNNING
\tName: alsa_output.usb-dac
\tDescription: USB DAC
\tChannel Map: aux0,aux1
\tMute: no
\tVolume: aux0: 6554 /  10% / -60.00 dB,   aux1: 65536 / 100% / 0.00 dB
\tBase Volume: 65536 / 100% / 0.00 dB
Sink #2
\tName: alsa_output.pci
\tDescription: Built-in Audio
\tChannel Map: mono
\tMute: yes
\tVolume: mono: 65536 / 100% / 0.00 dB
\tPorts:
\t\tline-out: Line Out (type: Line, priority: 9000, availability group: Legacy 1, not available)
\t\tspeaker: Speaker (type: Speaker, priority: 100, availability unknown)
\tActive Port: speaker
Sink #3
\tName: auto_null
\tDescription: Dummy Output
\tMute: no
\tVolume: mono: 65536 / 100% / 0.00 dB
"""
EMPTY_SOCKET = SINKS.replace("Port: speaker", "Port: line-out")
STREAM = """Sink Input #7
\tSink: {sink}
\tChannel Map: {channels}
\tMute: no
\tVolume: {channels}: 32768 /  50% / -18.06 dB
\t\tapplication.name = "HapticVLM"
\t\tapplication.process.id = "42"
"""
PROGRAMS = {
    "pactl list": SINKS,
    "pactl info": "Server Name: PulseAudio\nDefault Sink: alsa_output.pci\n",
}
WPCTL = {"wpctl get-volume": "Volume: 0.10 [MUTED]\n"}
MACOS = {"osascript -e": "output volume:6, input volume:50, alert volume:100, output muted:false\n"}


def said(programs: dict[str, str]):
    """A run of the programs of one system."""
    return lambda *command: programs.get(" ".join(command), programs.get(" ".join(command[:2])))


@each_row(
    ("programs", "output", "volume"),
    [
        (PROGRAMS, "alsa_output.usb-dac", OutputState(False, 1.0, "", ("aux0", "aux1"))),
        (PROGRAMS, "Built-in Audio", OutputState(True, 1.0, "", ("mono",))),
        (PROGRAMS, "default output (PulseAudio)", OutputState(True, 1.0, "", ("mono",))),
        (PROGRAMS, "HDMI", None),
        (WPCTL, "default", OutputState(True, 0.1)),
        (WPCTL, "USB DAC", None),
        (MACOS, "default", OutputState(False, 0.06)),
        ({}, "default", None),
        ({"pactl list": "Sink #1\n\tName: x\n"}, "x", None),
        ({"osascript -e": "missing value"}, "default", None),
    ],
)
def test_the_volume_is_read_from_what_the_system_prints(
    programs: dict[str, str], output: str, volume: OutputState | None
) -> None:
    assert output_state(output, said(programs)) == volume


def through(sink: int, channels: str, output: str = "USB DAC", said_of: str = SINKS):
    """The state of an output while a service plays on a sink."""
    streams = STREAM.format(sink=sink, channels=channels)
    run = said({**PROGRAMS, "pactl list": said_of, "pactl list sink-inputs": streams})
    return output_state(output, run, pid=42, hands=Channels(1, 2))


def test_only_a_muted_output_and_one_below_a_quarter_are_low() -> None:
    assert OutputState(True, 1.0).fault == OutputState(False, 0.24).fault == SPEAKER_LOW
    assert OutputState(False, 0.25).fault is None


def test_the_hand_that_gets_less_counts_and_so_does_the_stream() -> None:
    low = through(1, "aux0,aux1")
    assert low is not None
    assert (round(low.share, 3), low.fault) == (0.05, SPEAKER_LOW)
    least = output_state("USB DAC", said(PROGRAMS), hands=Channels(2, 1))
    assert least == OutputState(False, 0.1, "", ("aux0", "aux1"))


@each_row(
    ("state", "why"),
    [
        (through(2, "mono"), "Built-in Audio"),  # moved there
        (through(3, "mono", "default"), "into nothing"),
        (through(1, "front-left,front-right"), "front-left, front-right"),
        (through(2, "mono,mono", "default", EMPTY_SOCKET), "plugged"),
    ],
)
def test_samples_that_go_elsewhere_are_not_felt(state: OutputState | None, why: str) -> None:
    assert state is not None
    assert state.fault == SPEAKER_UNREACHED
    assert why in state.text


def test_the_watch_follows_a_change_keeps_it_without_an_answer_and_ends() -> None:
    answers = [OutputState(False, 1.0), OutputState(True, 1.0)]
    asked = threading.Semaphore(0)

    def ask() -> OutputState | None:
        asked.release()
        return answers.pop(0) if answers else None

    watch = OutputWatch(ask, every_s=0.0)
    until(lambda: not answers)
    while asked.acquire(blocking=False):
        pass
    assert asked.acquire(timeout=60.0 * PACE)  # of the two, the first has its answer
    assert asked.acquire(timeout=60.0 * PACE)
    assert watch.state == OutputState(True, 1.0)
    watch.close()
    until(lambda: "output state" not in [thread.name for thread in threading.enumerate()])


@pytest.mark.process
@pytest.mark.needs_toolchain("pulseaudio", "pipewire")
@pytest.mark.parametrize("kind", KINDS)
def test_a_real_sink_that_is_muted_or_turned_down_is_seen(kind: str) -> None:
    with null_sink(kind=kind):
        full = OutputState(False, 1.0, "", ("mono",))
        with subprocess.Popen(["pacat", "--playback", "/dev/zero"]) as player:
            until(lambda: _pactl("list", "sink-inputs").count(f'"{player.pid}"') == 1)
            number = _pactl("list", "short", "sink-inputs").split()[0]
            for command, value, is_muted in (("volume", "10%", False), ("mute", "1", True)):
                _pactl(f"set-sink-input-{command}", number, value)
                heard = output_state(NAME, pid=player.pid)
                assert heard == replace(full, muted=is_muted, share=0.1)
            assert output_state(NAME) == full
            player.kill()
        _pactl("set-sink-volume", "@DEFAULT_SINK@", "10%")
        assert output_state(NAME) == replace(full, share=0.1)
        _pactl("set-sink-mute", "@DEFAULT_SINK@", "1")
        for name, verdict in ((NAME, "wrong"), ("simulated", "note")):
            told = devices.found_audio(ServeOptions(speaker=name), [{"name": NAME}])
            assert (told.verdict, "is muted" in told.message) == (verdict, True)
        muted = replace(full, muted=True, share=0.1)
        assert output_state(NAME) == output_state("default") == muted


def _pactl(*words: str) -> str:
    return subprocess.run(["pactl", *words], check=True, capture_output=True, text=True).stdout
