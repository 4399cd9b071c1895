"""Tests the ring and the audio engine: no order is played late, and none half-written."""

import itertools
import multiprocessing
import os
import signal
import time

import numpy as np
import pytest
import soundfile
from pace import until

from hapticvlm.devices.errors import DeviceError
from hapticvlm.devices.speaker import engine as engine_module
from hapticvlm.devices.speaker.engine import AudioSettings, Engine
from hapticvlm.devices.speaker.output import LOST_S, Output
from hapticvlm.devices.speaker.ring import EngineStatus, PersistentState, Release, RestAll, Ring
from hapticvlm.devices.speaker.speaker import Speaker
from hapticvlm.rendering.vibration.vibration import RATE_HZ, Motion
from hapticvlm.rendering.vibration.voices import Command

SLOTS = 256
SILENT_S = 1.0

pytestmark = pytest.mark.process

BLOCK = 128


def command(**fields):
    arguments = {"hand": 1, "material": "wood", "interaction": "strike", "onset": True}
    arguments |= {"motion": Motion(0.5, 2.0), "seed": 3, "expires_at": time.monotonic() + 600.0}
    return Command(**{**arguments, **fields})


class Clock:
    """The clock of an engine that a test fills by hand."""

    def __init__(self):
        self.now = 100.0

    def monotonic(self):
        return self.now


@pytest.fixture
def clock(monkeypatch):
    clock = Clock()
    monkeypatch.setattr(engine_module, "time", clock)
    return clock


class Watched:
    """An engine's process as a watch sees it: whether it was called well, and nothing more."""

    ready_at = 1.0
    restarts = 0

    def supervise(self, _now, *, is_well):
        self.is_well = is_well


def silence(speaker, played, seconds=0.1):
    """Wait until so much more was played; return whether all of it was silent."""
    until(lambda: speaker.status().samples >= played + seconds * RATE_HZ)
    return not speaker.waveform_until(int(seconds * RATE_HZ / 2))[1].any()


def test_what_is_put_into_the_ring_comes_out_the_same_and_once():
    ring = Ring.create()
    orders = [command(), command(material=None, onset=False), Release(0), RestAll(), Release(1)]
    for order in orders:
        ring.put(order, 1.0)
    taken = list(ring.take(0))
    assert [number for number, _, _ in taken] == [1, 2, 3, 4, 5]
    assert [order for _, _, order in taken] == orders
    assert list(ring.take(5)) == []


def test_a_gain_set_while_the_engine_restarts_holds_for_the_new_one():
    speaker = Speaker(AudioSettings())
    speaker.start()
    try:
        os.kill(speaker.pid, signal.SIGKILL)  # type: ignore[arg-type]
        until(lambda: speaker.supervise(time.monotonic()))
        speaker.set_gain(0.0)
        until(lambda: speaker.supervise(time.monotonic()) is None and speaker.plays)
        number = speaker.play(command())
        until(lambda: speaker.status().newest >= number)
        assert silence(speaker, speaker.status().samples)
        speaker.set_gain(1.0)
        speaker.play(command())
        until(lambda: speaker.waveform_until(4000)[1].any())
    finally:
        speaker.close()


def test_an_engine_is_silent_only_to_a_watch_that_was_awake():
    speaker = Speaker(AudioSettings())
    child = speaker._child = Watched()  # type: ignore[assignment]
    beaten_at, now = 100.0, 100.0

    def watch(seconds):
        """Look ten times a second, as the gateway does, and say what the engine was found to be."""
        nonlocal now
        found = []
        for _ in range(round(seconds * 10)):
            now += 0.1
            status = EngineStatus(beaten_at, 0.0, 0, 0, 0, 0, 0, realtime=True, has_output=True)
            speaker._ring.report(status, np.empty(0, np.float32))
            speaker.supervise(now)
            found.append(child.is_well)
        return found

    assert all(watch(SILENT_S))
    now += 2.0 * SILENT_S  # the watch sleeps too, as on a suspended machine
    assert all(watch(SILENT_S))
    assert not any(watch(0.2)[1:])
    beaten_at = now
    assert all(watch(SILENT_S - 0.1))


def test_an_output_is_lost_when_it_asked_for_nothing_since_a_watch_that_was_awake():
    output = Output(lambda size: np.zeros(size, np.float32), realtime=False, last_request_at=10.0)
    long_after = 10.1 + LOST_S
    assert output.is_lost(long_after, awake_since=0.0)
    assert not output.is_lost(long_after, awake_since=10.2)  # after a suspend
    assert not output.is_lost(10.2, awake_since=0.0)


def test_an_engine_that_stands_still_is_said_to_hang():
    speaker = Speaker(AudioSettings())
    speaker.start()
    try:
        until(lambda: speaker.supervise(time.monotonic()) is None and speaker.plays)
        os.kill(speaker.pid, signal.SIGSTOP)  # type: ignore[arg-type]
        assert "hung" in until(lambda: speaker.supervise(time.monotonic()))
    finally:
        speaker.close()


def test_an_engine_that_has_not_spoken_yet_lacks_no_output():
    speaker = Speaker(AudioSettings())
    assert speaker.supervise(time.monotonic()) is None
    assert speaker.faults == ()


def test_a_reader_a_whole_ring_behind_is_told_what_it_lost():
    ring = Ring.create()
    for number in range(SLOTS + 50):
        ring.put(Release(number % 2), 1.0)
    taken = [order for _, _, order in ring.take(0)]
    lost = taken.count(None)
    assert lost == 51
    assert taken[-1] is not None


def test_a_half_written_record_is_left_until_it_is_whole():
    ring = Ring.create()
    ring.put(Release(1), 1.0)
    ring.put(command(), 1.0)
    view = np.frombuffer(memoryview(ring.shared), np.uint8)
    (last,) = np.flatnonzero(view)[-1:]
    view[last] ^= 0xFF
    assert [order for _, _, order in ring.take(0)] == [Release(1)]
    view[last] ^= 0xFF
    assert [number for number, _, _ in ring.take(1)] == [2]


def report_for_ever(shared):
    """Report as the engine does, without a pause; all numbers of a status are equal."""
    ring, nothing = Ring(shared), np.empty(0, np.float32)
    for i in itertools.count(1):
        ring.report(EngineStatus(i, 0.5, i, i, i, i, i, realtime=True, has_output=True), nothing)


def test_a_status_read_while_it_is_written_is_whole():
    ring = Ring.create()
    writer = multiprocessing.get_context("spawn").Process(
        target=report_for_ever, args=(ring.shared,), daemon=True
    )
    writer.start()
    until(lambda: ring.status().beat_at)
    read: list[EngineStatus] = []

    def has_met_many() -> bool:
        """Read on: on a busy machine the writer writes seldom while this reads."""
        read.extend(ring.status() for _ in range(10_000))
        return len({s.samples for s in read}) > 100

    until(has_met_many)
    writer.kill()
    writer.join()
    assert all(s.has_output and s.realtime and s.level == 0.5 for s in read)
    assert all(s.beat_at == s.underruns == s.samples == s.newest for s in read)
    assert [s.samples for s in read] == sorted(s.samples for s in read)


def test_a_command_is_heard_from_the_first_sample_of_the_next_block(clock):
    ring = Ring.create()
    engine = Engine(ring)
    assert not engine.fill(BLOCK).any()
    number = ring.put(command(expires_at=clock.now + 0.25), clock.now)
    clock.now += 0.02
    assert engine.fill(BLOCK)[1:].any()
    assert ring.status().newest == number
    assert ring.delays(number, number)[0] == pytest.approx(0.02)


def test_an_engine_whose_gateway_hangs_falls_silent_by_itself(clock):
    ring = Ring.create()
    engine = Engine(ring)
    sliding = command(interaction="slide", onset=False, expires_at=clock.now + 0.25)
    ring.put(sliding, clock.now)
    for _ in range(30):
        engine.fill(BLOCK)
    assert ring.status().level > 0.0
    clock.now += 0.26
    blocks = np.concatenate([engine.fill(BLOCK) for _ in range(30)])
    assert not blocks[RATE_HZ // 50 + BLOCK :].any()


def test_the_level_told_is_that_of_the_loudest_moment_since_the_last(clock):
    speaker = Speaker(AudioSettings())
    engine = Engine(speaker._ring)
    assert speaker.loudest() == 0.0
    speaker.play(command(material="glass", interaction="tap", expires_at=clock.now + 0.25))
    for _ in range(RATE_HZ // 2 // BLOCK):  # half a second: a tap is long over
        engine.fill(BLOCK)
        clock.now += BLOCK / RATE_HZ
    assert speaker.status().level < 1e-3 < 0.01 < speaker.loudest()
    assert speaker.loudest() < 1e-3


def test_commands_written_before_an_engine_started_are_not_played_late():
    ring = Ring.create()
    ring.put(command(), time.monotonic())
    assert not Engine(ring).fill(BLOCK).any()


def test_the_simulated_speaker_writes_what_it_played(tmp_path):
    path = tmp_path / "played.wav"
    speaker = Speaker(AudioSettings(wav=path))
    speaker.start()
    try:
        number = speaker.play(command())
        until(lambda: speaker.status().newest >= number)
        played_before = speaker.status().samples
        until(lambda: speaker.status().samples > played_before + 0.2 * RATE_HZ)
        status = speaker.status()
    finally:
        speaker.close()
    played, rate = soundfile.read(path, dtype="float32")
    assert rate == RATE_HZ
    assert played.size >= status.samples
    onset = int(np.flatnonzero(np.abs(played) > 1e-4)[0])
    assert not played[:onset].all()
    assert np.abs(played).max() <= 1.0


def overrun(ring):
    """Put more orders into the ring than it holds."""
    for _ in range(2 * SLOTS):
        ring.put(command(), time.monotonic())


def test_a_gain_and_a_rest_outlive_orders_that_were_lost():
    ring = Ring.create()
    engine = Engine(ring)
    ring.put(command(interaction="slide"), time.monotonic())
    engine.fill(4800)
    assert engine.fill(4800).any()
    rested = ring.put(RestAll(), time.monotonic())
    ring.set_persistent(PersistentState(0.0, rested))
    overrun(ring)
    engine.fill(4800)
    assert not engine.fill(4800).any()
    ring.put(command(), time.monotonic())
    assert not engine.fill(4800).any()  # the gain is 0 still
    ring.set_persistent(PersistentState(1.0, rested))
    ring.put(command(), time.monotonic())
    assert engine.fill(4800).any()


def test_a_rest_that_was_lost_with_other_orders_is_kept():
    ring = Ring.create()
    engine = Engine(ring)
    sliding = command(interaction="slide")
    ring.put(sliding, time.monotonic())
    engine.fill(4800)
    ring.set_persistent(PersistentState(1.0, ring.put(RestAll(), time.monotonic())))
    for _ in range(2 * SLOTS):
        ring.put(sliding, time.monotonic())
    engine.fill(4800)
    assert not engine.fill(4800).any()


def test_a_persistent_state_that_is_being_written_is_left_until_it_is_whole():
    ring = Ring.create()
    assert ring.persistent() is None
    ring.set_persistent(PersistentState(0.5, 7))
    assert ring.persistent() == PersistentState(0.5, 7)
    view = np.frombuffer(memoryview(ring.shared), np.uint8)
    (last,) = np.flatnonzero(view)[-1:]
    view[last] ^= 0xFF
    assert ring.persistent() is None


def test_a_wav_in_a_folder_that_is_not_there_is_refused_by_name(tmp_path):
    speaker = Speaker(AudioSettings(wav=tmp_path / "missing" / "played.wav"))
    with pytest.raises(DeviceError, match=r"cannot write --wav .*played\.wav"):
        speaker.start()


def test_a_wav_that_another_speaker_writes_is_refused(tmp_path):
    first, second = (Speaker(AudioSettings(wav=tmp_path / "played.wav")) for _ in range(2))
    first.start()
    try:
        with pytest.raises(DeviceError, match="another program writes to it; choose another file"):
            second.start()
    finally:
        first.close()


def test_an_engine_that_was_restarted_goes_on_in_a_file_of_its_own(tmp_path):
    speaker = Speaker(AudioSettings(wav=tmp_path / "played.wav"))
    speaker.start()
    try:
        os.kill(speaker.pid, signal.SIGKILL)  # type: ignore[arg-type]
        until(lambda: speaker.supervise(time.monotonic()))
        until(lambda: speaker.supervise(time.monotonic()) is None and speaker.plays)
    finally:
        speaker.close()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["played-2.wav", "played.wav"]
