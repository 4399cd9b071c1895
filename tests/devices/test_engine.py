"""Tests the audio engine's blocks: their samples, their reports, and its sleep during silence."""

import time

import numpy as np
import pytest
from numpy.typing import NDArray

from hapticvlm.devices.speaker.channels import Channels
from hapticvlm.devices.speaker.engine import AudioSettings, Engine
from hapticvlm.devices.speaker.ring import (
    SAMPLES,
    EngineStatus,
    PersistentState,
    Release,
    RestAll,
    Ring,
)
from hapticvlm.rendering.vibration.vibration import RATE_HZ, Motion
from hapticvlm.rendering.vibration.voices import Command

BLOCK = 128


def _strike() -> Command:
    until = time.monotonic() + 600.0
    return Command(0, "metal", "strike", True, Motion(0.5, 1.0), seed=1, expires_at=until)


@pytest.fixture
def asleep() -> tuple[Ring, Engine]:
    ring = Ring.create()
    engine = Engine(ring)
    for _ in range(3):
        engine.fill(BLOCK)
    return ring, engine


def test_a_sleeping_engine_hands_out_the_same_zeros_each_time(asleep: tuple[Ring, Engine]) -> None:
    _, engine = asleep
    first = engine.fill(BLOCK)
    assert not first.any()
    assert engine.fill(BLOCK) is first


def test_a_sleeping_engine_plays_an_order_in_the_very_next_block(
    asleep: tuple[Ring, Engine],
) -> None:
    ring, engine = asleep
    engine.fill(BLOCK)
    number = ring.put(_strike(), time.monotonic())
    played = np.concatenate([engine.fill(BLOCK) for _ in range(4)])
    assert 0.1 < np.abs(played).max() < 1.0
    assert ring.status().newest == number
    assert ring.status().level > 0.0


def test_an_engine_is_awake_between_the_grains_of_a_press_until_it_is_released(
    asleep: tuple[Ring, Engine],
) -> None:
    ring, engine = asleep
    until = time.monotonic() + 600.0
    ring.put(Command(0, "fabric", "press", False, Motion(0.0, 1.0), 1, until), time.monotonic())
    assert not engine.fill(BLOCK).any(), "its first grain is still to come"
    assert any(engine.fill(BLOCK).any() for _ in range(40))
    ring.put(Command(0, "wood", "slide", False, Motion(0.3, 2.0), 1, until), time.monotonic())
    assert [engine.fill(BLOCK) for _ in range(40)][-1].any()
    ring.put(Release(0), time.monotonic())
    assert not [engine.fill(BLOCK) for _ in range(40)][-1].any()


def test_silence_is_counted_and_reported_as_it_is_played(asleep: tuple[Ring, Engine]) -> None:
    ring, engine = asleep
    ring.put(_strike(), time.monotonic())
    sounding = [engine.fill(BLOCK) for _ in range(8)]
    ring.put(RestAll(), time.monotonic())
    silent = [engine.fill(BLOCK) for _ in range(300)]
    assert not silent[-1].any()
    played = (3 + len(sounding) + len(silent)) * BLOCK
    behind = played - ring.status().samples
    assert 0 <= behind <= 0.02 * RATE_HZ + BLOCK
    assert not ring.waveform(250 * BLOCK).any()
    assert ring.status().level == 0.0
    wave = np.concatenate([*sounding, *silent])[: played - behind - 3 * BLOCK]
    assert np.array_equal(ring.waveform(wave.size), wave)


def test_a_gain_set_in_silence_is_in_force_from_the_first_sample(
    asleep: tuple[Ring, Engine],
) -> None:
    ring, engine = asleep
    ring.set_persistent(PersistentState(0.0, 0))
    engine.fill(BLOCK)
    ring.put(_strike(), time.monotonic())
    assert not any(engine.fill(BLOCK).any() for _ in range(20))


@pytest.mark.parametrize(
    ("rendered", "played", "scrubbed"),
    [(2.0, 1.0, 0), (-2.0, -1.0, 0), (np.nan, 0.0, 1), (np.inf, 0.0, 1)],
)
def test_what_leaves_the_range_is_cut_and_what_is_no_number_is_silence_and_counted(
    asleep: tuple[Ring, Engine],
    monkeypatch: pytest.MonkeyPatch,
    rendered: float,
    played: float,
    scrubbed: int,
) -> None:
    ring, engine = asleep
    wave = np.full(BLOCK, rendered, np.float32)
    monkeypatch.setattr(engine._mixers[0], "render", lambda *_: wave)
    ring.put(_strike(), time.monotonic())
    assert set(engine.fill(BLOCK)) == {played}
    assert ring.status().scrubbed == scrubbed


def test_a_state_that_is_being_written_is_applied_in_the_next_block(
    asleep: tuple[Ring, Engine], monkeypatch: pytest.MonkeyPatch
) -> None:
    ring, engine = asleep
    ring.set_persistent(PersistentState(0.5, 0))
    with monkeypatch.context() as written:
        written.setattr(ring, "persistent", lambda: None)
        engine.fill(BLOCK)
    assert engine._mixers[0].gain == 1.0
    engine.fill(BLOCK)
    assert engine._mixers[0].gain == 0.5


def test_an_output_that_comes_back_plays_no_rest_and_what_was_lost_is_counted(
    asleep: tuple[Ring, Engine],
) -> None:
    ring, engine = asleep
    usual = AudioSettings()
    assert (usual.block, usual.gain, usual.level) == (BLOCK, 1.0, 1.0)
    until = time.monotonic() + 600.0
    ring.put(Command(0, "wood", "slide", False, Motion(0.3, 2.0), 1, until), time.monotonic())
    assert [engine.fill(BLOCK) for _ in range(40)][-1].any()
    engine.rest_unplayed()
    assert not engine.fill(BLOCK).any()
    before = ring.status()
    engine.beat()
    assert (ring.status().samples, ring.status().beat_at > before.beat_at) == (before.samples, True)
    for _ in range(256 + 3):
        ring.put(Release(0), time.monotonic())
    engine.fill(BLOCK)
    assert ring.status().lost == 4, "orders that were overwritten unread; 255 fit"


def test_an_engine_that_fades_out_is_silent_and_takes_no_order_any_more(
    asleep: tuple[Ring, Engine],
) -> None:
    ring, engine = asleep
    until = time.monotonic() + 600.0
    ring.put(Command(0, "wood", "slide", False, Motion(0.3, 2.0), 1, until), time.monotonic())
    assert [engine.fill(BLOCK) for _ in range(40)][-1].any()
    engine.fade_out()
    ring.put(_strike(), time.monotonic())
    assert not [engine.fill(BLOCK) for _ in range(40)][-1].any()


def test_an_engine_does_not_sleep_over_an_order_to_rest_that_is_still_to_come(
    asleep: tuple[Ring, Engine],
) -> None:
    ring, engine = asleep
    ring.set_persistent(
        PersistentState(1.0, ring.newest + 2)
    )  # it stands before the order itself is in the ring
    ring.put(_strike(), time.monotonic())
    assert np.concatenate([engine.fill(BLOCK) for _ in range(4)]).any()
    ring.put(RestAll(), time.monotonic())
    last = [engine.fill(BLOCK) for _ in range(40)][-1]
    assert not last.any()


def test_hands_with_a_channel_each_are_rendered_apart_and_rest_together():
    ring = Ring.create()
    engine = Engine(ring, AudioSettings(channels=Channels(1, 2)))
    engine.fill(BLOCK)
    until = time.monotonic() + 600.0
    ring.put(Command(1, "wood", "slide", False, Motion(0.3, 2.0), 1, until), time.monotonic())
    right = np.concatenate([engine.fill(BLOCK) for _ in range(40)])
    assert right.shape == (40 * BLOCK, 2)
    assert not right[:, 0].any()
    assert np.abs(right[:, 1]).max() > 0.01
    ring.put(Command(0, "metal", "strike", True, Motion(0.5, 1.0), 1, until), time.monotonic())
    both = np.concatenate([engine.fill(BLOCK) for _ in range(40)])
    assert both.any(axis=0).all()
    shown = ring.waveform(BLOCK)
    assert shown.shape == (BLOCK,)
    assert np.allclose(shown, both[-BLOCK:].sum(axis=1), atol=1e-6)
    ring.put(RestAll(), time.monotonic())
    assert not [engine.fill(BLOCK) for _ in range(40)][-1].any()
    for hand in (0, 1):
        hard = Command(hand, "fabric", "slide", False, Motion(3.0, 30.0), 1, until)
        ring.put(hard, time.monotonic())
    both = np.concatenate([engine.fill(BLOCK) for _ in range(40)]).sum(axis=1)
    assert both.min() < -1.0
    assert np.allclose(ring.waveform(both.size), np.clip(both, -1.0, 1.0), atol=1e-6)


def test_one_hand_alone_sounds_the_same_on_its_own_channel_as_in_the_mix():
    waves = []
    for channels in (None, Channels(1, 2)):
        ring = Ring.create()
        engine = Engine(ring, AudioSettings(channels=channels))
        engine.fill(BLOCK)
        ring.put(_strike(), time.monotonic())
        waves.append(np.concatenate([engine.fill(BLOCK) for _ in range(8)]))
    assert np.array_equal(waves[0], waves[1][:, 0])


def struck(voice: str) -> tuple[Ring, Engine, NDArray[np.float32]]:
    """A strike on an output of this voice, 0.1 s of it."""
    ring = Ring.create()
    engine = Engine(ring, AudioSettings(voice=voice))
    engine.fill(BLOCK)
    ring.put(_strike(), time.monotonic())
    return ring, engine, np.concatenate([engine.fill(BLOCK) for _ in range(38)])


def above_350_hz(wave: NDArray[np.float32]) -> float:
    power = np.abs(np.fft.rfft(wave)) ** 2
    return float(power[round(350.0 * wave.size / RATE_HZ) :].sum() / power.sum())


def test_an_output_for_ears_gets_the_sound_and_pages_still_get_the_true_voice() -> None:
    ring, _, true = struck("true")
    heard_ring, _, heard = struck("sound")
    assert np.array_equal(heard_ring.waveform(true.size), ring.waveform(true.size))
    assert above_350_hz(true) < above_350_hz(heard)
    assert above_350_hz(heard) > 0.95
    assert np.abs(heard).max() > 0.1


def test_an_output_for_ears_is_silent_after_a_rest_and_sleeps() -> None:
    ring, engine, _ = struck("sound")
    ring.put(RestAll(), time.monotonic())
    last = [engine.fill(BLOCK) for _ in range(60)][-1]
    assert not last.any()
    assert engine.fill(BLOCK) is last


@pytest.mark.parametrize("count", [0, 1, 300, 1000, SAMPLES])
def test_the_newest_samples_are_read_in_order_across_the_end_of_the_memory(count: int) -> None:
    ring = Ring.create()
    played = np.arange(SAMPLES + 200, dtype=np.float32)
    for end in range(100, played.size + 1, 100):
        status = EngineStatus(1.0, 0.0, 0, 0, 0, end, 0, realtime=False)
        ring.report(status, played[end - 100 : end])
    end, newest = ring.waveform_until(count)
    assert end == played.size
    assert np.array_equal(newest, played[played.size - count :])
