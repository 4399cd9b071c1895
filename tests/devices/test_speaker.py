"""Tests the speaker on a real sound server, by the monitor of a sink that comes and goes."""

import asyncio
import subprocess
import sys
import time

import numpy as np
import pytest
from conftest import peer, status
from jack_server import jack_underruns
from null_sink import KINDS, NAME, PIPEWIRE, PULSEAUDIO, QUAD, null_sink, recording
from pace import PACE, until
from tiers import nightly_except

from hapticvlm.client.local_service import running
from hapticvlm.devices.speaker.channels import DUALSENSE_CHANNELS, read_channels
from hapticvlm.devices.speaker.engine import AudioSettings
from hapticvlm.devices.speaker.output import Output, OutputError, choose, playbacks
from hapticvlm.devices.speaker.speaker import Speaker
from hapticvlm.rendering.vibration.vibration import RATE_HZ, Motion
from hapticvlm.rendering.vibration.voices import Command

pytestmark = pytest.mark.process

needs_pulseaudio = pytest.mark.needs_toolchain("pulseaudio")  # a sink that is recorded
needs_both = pytest.mark.needs_toolchain("pulseaudio", "pipewire")
needs_jack = pytest.mark.needs_toolchain("jackd")  # a server whose driver plays into nothing
PATIENCE_S = 30.0 * PACE
LEASE_S = 0.2
PRO_AUDIO = "aux0,aux1,aux2,aux3"  # as the profile of this name calls the channels


def test_a_machine_without_miniaudio_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "miniaudio", None)
    with pytest.raises(OutputError, match=r"needs miniaudio.* install.* miniaudio"):
        playbacks()


def strike(**fields):
    """A command that is played however late a busy machine comes to it, unless a lease is given."""
    given = {"hand": 1, "material": "wood", "interaction": "strike", "onset": True}
    given |= {"motion": Motion(0.5, 2.0), "seed": 3, "expires_at": time.monotonic() + PATIENCE_S}
    return Command(**{**given, **fields})


def troubles(speaker):
    return lambda: speaker.supervise(time.monotonic())


@pytest.fixture
def sink():
    with null_sink() as server:
        yield server


@pytest.fixture
def speaker(sink):  # noqa: ARG001 - it plays there
    speaker = Speaker(AudioSettings(output=NAME))
    speaker.start()
    yield speaker
    speaker.close()


@needs_pulseaudio
def test_a_strike_is_heard_at_the_sink_within_full_scale(speaker):
    with recording() as heard:
        begun = time.monotonic()
        assert heard.is_silent_since(0.0)
        speaker.play(strike())
        until(lambda: heard.onset_after(begun, PATIENCE_S))
        time.sleep(LEASE_S)
    assert 0.05 < np.abs(heard.samples()).max() <= 1.0
    assert speaker.name == NAME
    assert not speaker.simulated


@needs_both
@pytest.mark.parametrize(
    ("output", "name", "given", "channel_map", "kind"),
    nightly_except(
        2,
        [
            ("dualsense", "DualSense", None, QUAD, PULSEAUDIO),
            ("Exciters", "Exciters", "left=2,right=1", QUAD, PIPEWIRE),
            ("dualsense", "DualSense", None, PRO_AUDIO, PIPEWIRE),
            ("dualsense", "DualSense", None, PRO_AUDIO, PULSEAUDIO),
            ("default", "Exciters", "left=2,right=1", PRO_AUDIO, PULSEAUDIO),
            ("default", "Exciters", "left=2,right=1", PRO_AUDIO, PIPEWIRE),
        ],
    ),
)
def test_each_hand_is_heard_on_its_own_channel_and_nothing_on_the_others(
    output, name, given, channel_map, kind
):
    channels = DUALSENSE_CHANNELS if given is None else read_channels(given)
    with null_sink(4, name, channel_map, kind), recording(4, channel_map) as heard:
        speaker = Speaker(AudioSettings(output=output, channels=channels))
        speaker.start()
        try:
            assert name in speaker.name or output == "default"
            speaker.play(strike(hand=0, material="metal"))
            until(lambda: heard.onset_after(0.0, float("inf")))
            until(lambda: speaker.status().level == 0.0)
            time.sleep(2.0 * LEASE_S)
            left_only = len(heard.samples()) // 4
            speaker.play(strike(hand=1, material="glass"))
            until(lambda: np.any(heard.samples()[4 * left_only :]))
            time.sleep(LEASE_S)
        finally:
            speaker.close()
    samples = heard.samples()
    frames = samples[: len(samples) // 4 * 4].reshape(-1, 4)
    loudest = [np.abs(part).max(axis=0) for part in (frames[:left_only], frames[left_only:])]
    for hand, place in enumerate((channels.left, channels.right)):
        assert loudest[hand][place - 1] > 0.05
        assert np.delete(loudest[hand], place - 1).max() < 1e-3 * loudest[hand][place - 1]  # -60 dB


@needs_pulseaudio
def test_of_two_outputs_of_one_name_neither_is_taken_unasked_nor_for_the_other():
    with null_sink(1, "Exciter"):
        words = ("sink_name=b", "sink_properties=device.description=Exciter")
        pactl("load-module", "module-null-sink", *words)
        first, second = outputs = playbacks()
        with pytest.raises(OutputError, match=r"several.*Exciter \[palm\], Exciter \[b\]"):
            choose(outputs, "exciter")
        assert choose(outputs, "b") == choose(outputs, "Exciter [b]") == second
        assert choose(outputs, "exciter", "palm") == first  # as before a loss
        speaker = Speaker(AudioSettings(output="b"))
        speaker.start()
        try:
            assert speaker.plays
            pactl("set-sink-mute", "b", "1")
            until(lambda: speaker.faults == ("speaker_low",))
            assert not speaker.plays
        finally:
            speaker.close()


@needs_pulseaudio
def test_channels_that_only_pactl_knows_are_refused_without_it(monkeypatch):
    with null_sink(4, r"'Pad\ Pro'", PRO_AUDIO):
        monkeypatch.setenv("PATH", "/nowhere")
        with pytest.raises(OutputError, match=r"Haptic Feedback"):
            Output(np.zeros, False, hands=DUALSENSE_CHANNELS).open("Pad Pro", 128)


def test_no_playstation_controller_is_said_with_what_to_do():
    with pytest.raises(OutputError, match="USB"):
        choose([{"name": "Built-in Audio"}], "dualsense")
    result = choose([{"name": "Built-in"}, {"name": "Wireless Controller Surround"}], "DualSense")
    assert result == {"name": "Wireless Controller Surround"}


def listed(name, channels):
    return {"name": name, "formats": [{"channels": channels}]}


PS5 = "DualSense wireless controller (PS5)"
HAPTIC = f"{PS5} Internal Mono Speaker + Haptic Feedback"
MONO, HEADPHONES = f"{PS5} Internal Mono Speaker", f"{PS5} 3.5mm Headphones"


@pytest.mark.parametrize(
    ("others", "name"),
    [
        ([(MONO, 1), (HEADPHONES, 2)], HAPTIC),
        ([("Xbox Wireless Controller Headset", 2)], "DualSense Edge Wireless Controller"),
        ([("Xbox Wireless Controller Headset", 8)], "Wireless Controller Analog Surround 4.0"),
    ],
)
def test_of_a_playstation_controller_the_output_with_the_voice_coils_is_taken(others, name):
    outputs = [*(listed(*other) for other in others), listed(name, 4)]

    assert choose(outputs, "dualsense") == listed(name, 4)


@pytest.mark.parametrize(
    "outputs", [[(MONO, 1), (HEADPHONES, 2)], [("Wireless Controller Analog Stereo", 2)]]
)
def test_a_controller_without_its_four_channels_is_refused_with_the_profile_to_choose(outputs):
    with pytest.raises(OutputError, match=r"Haptic Feedback.*Pro Audio") as refused:
        choose([listed(*output) for output in outputs], "dualsense")

    assert all(name in str(refused.value) for name, _ in outputs)


@pytest.mark.parametrize(
    "text", ["", "left=1", "left=0,right=1", "left=2,right=2", "left=1,right=9"]
)
def test_channels_that_no_output_has_are_refused_with_an_example(text):
    with pytest.raises(ValueError, match="for example left=1,right=2"):
        read_channels(text)


@needs_pulseaudio
def test_nothing_is_heard_after_the_lease(speaker):
    with recording() as heard:

        def is_heard():
            lasts = time.monotonic() + LEASE_S
            speaker.play(strike(interaction="slide", onset=False, expires_at=lasts))
            return heard.onset_after(0.0, float("inf"))

        until(is_heard)
        until(lambda: speaker.status().level == 0.0)
        time.sleep(0.5)  # what the sound server still held
        rested = time.monotonic()
        time.sleep(0.5)
        assert heard.chunks[-1][0] > rested
        assert heard.is_silent_since(rested)


@needs_pulseaudio
@pytest.mark.parametrize("loss", ["sink", "server"])
def test_an_output_that_goes_is_told_and_plays_again_when_it_is_back(speaker, sink, loss):
    assert speaker.plays
    pid = speaker.pid
    (sink.unplug if loss == "sink" else sink.kill)()
    assert "gone" in until(troubles(speaker))
    assert not speaker.plays
    assert speaker.faults == ("speaker_gone",)
    until_later = time.monotonic() + 3600.0  # but nothing late may be played
    speaker.play(strike(interaction="slide", onset=False, expires_at=until_later))
    speaker.set_gain(0.5)
    (sink.plug_in if loss == "sink" else sink.start)()
    until(lambda: speaker.supervise(time.monotonic()) is None and speaker.plays)
    assert speaker.faults == ()
    assert speaker.restarts == 0
    assert speaker.pid == pid
    with recording() as heard:
        time.sleep(0.5)
        assert heard.is_silent_since(0.0)
        speaker.play(strike())
        until(lambda: heard.onset_after(0.0, float("inf")))


@needs_pulseaudio
@pytest.mark.usefixtures("sink")
def test_the_level_holds_whatever_gain_a_scene_sets():
    speaker = Speaker(AudioSettings(output=NAME, level=0.25))
    speaker.start()
    try:
        with recording() as heard:
            speaker.set_gain(1.0)

            def is_loud():
                lasts = time.monotonic() + LEASE_S
                for seed in range(5):
                    speaker.play(strike(motion=Motion(3.0, 20.0), seed=seed, expires_at=lasts))
                return np.abs(heard.samples()).max(initial=0.0) > 0.05

            until(is_loud)
            time.sleep(LEASE_S)
        assert np.abs(heard.samples()).max() <= 0.25
    finally:
        speaker.close()


def test_an_output_is_chosen_by_name_or_by_the_only_part_that_fits():
    outputs = [{"name": "USB Speaker"}, {"name": "USB Speaker 2"}, {"name": "HDMI"}]
    assert choose(outputs, "default") is None
    assert choose(outputs, "usb speaker") == {"name": "USB Speaker"}
    assert choose(outputs, "hdm") == {"name": "HDMI"}
    with pytest.raises(OutputError, match="several outputs match: USB Speaker, USB"):
        choose(outputs, "usb")
    with pytest.raises(OutputError, match="this machine has: none"):
        choose([], "default")


@needs_both
@pytest.mark.parametrize("kind", nightly_except(2, [PIPEWIRE, PULSEAUDIO]))
async def test_a_scene_is_told_that_the_speaker_is_gone_and_that_it_is_back(kind):
    with null_sink(kind=kind) as sink, running(["--speaker", NAME]) as service:
        async with peer(service) as scene:
            await scene.hello()
            assert scene.welcome["devices"]["speaker"] == {"name": NAME, "simulated": False}
            assert (await scene.telemetry())["faults"] == []
            await asyncio.to_thread(sink.unplug)
            assert "gone" in (await scene.event("error"))["text"]
            assert (await scene.telemetry())["faults"] == ["speaker_gone"]
            assert "audio output" in status(service)["speaker"]["faults"]["speaker_gone"]
            await asyncio.to_thread(sink.plug_in)
            async with asyncio.timeout(PATIENCE_S):
                while (await scene.telemetry())["faults"]:
                    pass


SILENCING = {  # with pactl: what makes the right hand silent, and what undoes it
    "set-sink-mute": ("1", "0"),
    "set-sink-volume": ("100% 100% 100% 0%", "100%"),
    "set-sink-input-mute": ("1", "0"),
    "set-sink-input-volume": ("5%", "100%"),
}


@needs_both
@pytest.mark.nightly
@pytest.mark.parametrize("kind", KINDS)
async def test_a_scene_is_told_of_each_way_in_which_its_hand_falls_silent(kind):
    hands = ["--channels", "left=3,right=4"]
    with null_sink(4, NAME, PRO_AUDIO, kind), running(["--speaker", NAME, *hands]) as service:
        async with peer(service) as scene:
            await scene.hello()

            async def told(faults):
                async with asyncio.timeout(PATIENCE_S):
                    while (await scene.telemetry())["faults"] != faults:
                        pass
                until(lambda: list(status(service)["speaker"]["faults"]) == faults)
                until(lambda: status(service)["speaker"]["plays"] is (faults == []))

            stream, *_ = pactl("list", "short", "sink-inputs").split()
            for command, (silent, loud) in SILENCING.items():
                target = stream if "input" in command else "palm"
                pactl(command, target, *silent.split())
                await told(["speaker_low"])
                assert (await scene.event("error"))["text"].startswith(
                    f"the audio output {NAME} is"
                )
                pactl(command, target, loud)
                await told([])


def pactl(*words):
    return subprocess.run(["pactl", *words], check=True, capture_output=True, text=True).stdout


@needs_jack
def test_jack_is_played_on_in_two_channels_and_at_its_own_pace():
    seconds = 3.0
    result = jack_underruns(seconds, 256, realtime=True)

    assert result["samples"] == pytest.approx(RATE_HZ * seconds, rel=0.5)
    assert result["underruns"] * 256 < 0.5 * RATE_HZ * seconds
