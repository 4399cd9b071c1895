"""Things that vibrate by themselves: in the hand, through a table, and not at all through air."""

import math
import tomllib
from pathlib import Path

import numpy as np
import pytest
from session_messages import only, owner, scene, touch

import hapticvlm.evidence.hums
from hapticvlm.evidence.hums import hum_of
from hapticvlm.messages import SceneObject, Vibrates
from hapticvlm.perception import drive_threshold_db
from hapticvlm.rendering.vibration.hum import Hum, Tone
from hapticvlm.rendering.vibration.vibration import RATE_HZ, Motion
from hapticvlm.rendering.vibration.voices import Command, Voices
from hapticvlm.session.actions import PlayVibration
from hapticvlm.session.session import SceneSession

HUMS = {
    kind: hum
    for kind, hum in tomllib.loads(
        (Path(hapticvlm.evidence.hums.__file__).parent / "hums.toml").read_text()
    ).items()
    if isinstance(hum, dict)
}
WASHING_MACHINE = SceneObject(object_id="w", name="washing machine", stands_on=["table"])
TABLE = SceneObject(object_id="table", name="wooden table", material="wood")
MUG = SceneObject(object_id="mug", material="ceramic", stands_on=["table"])
SHELF = SceneObject(object_id="shelf", material="wood")


def touched(session: SceneSession, object_id: str) -> Hum | None:
    """What a hand that touches this feels of what vibrates."""
    (played,) = only(session.receive(touch(object_id=object_id), 0.0), PlayVibration)
    return played.command.hum


def felt(object_id: str, *objects: SceneObject) -> Hum | None:
    return touched(owner(*objects), object_id)


def wave(hum: Hum | None) -> np.ndarray:
    """What a resting hand gets of this, (N,), after its fade-in."""
    voices = Voices(fills_caches=False)
    voices.apply(Command(0, None, "press", False, Motion(0.0, 1.0), 0, math.inf, hum=hum))
    voices.render(RATE_HZ // 4, 0.0)
    return voices.render(RATE_HZ, 0.25)


def level_db(samples: np.ndarray) -> float:
    return 10.0 * float(np.log10(np.mean(samples.astype(float) ** 2) + 1e-20))


def test_a_washing_machine_is_felt_in_the_hand_through_the_table_and_not_across_the_room() -> None:
    scene = (WASHING_MACHINE, TABLE, MUG, SHELF)
    held, table, mug, shelf = (wave(felt(name, *scene)) for name in ("w", "table", "mug", "shelf"))

    assert level_db(held) > -40.0
    assert 10.0 < level_db(held) - level_db(table) < 20.0
    assert 3.0 < level_db(table) - level_db(mug) < 12.0
    assert np.all(shelf == 0.0)


def through_a_table(kind: str, material: str = "wood", thickness_m: float | None = None) -> float:
    """Level above the palm's threshold of a named hum, felt on the table that carries it, dB."""
    source = SceneObject(object_id="it", name=HUMS[kind]["words"][0], stands_on=["table"])
    table = SceneObject(object_id="table", material=material, thickness_m=thickness_m)
    hum = felt("table", source, table)
    return -math.inf if hum is None else hum.sensation_db()


def test_ten_of_fifteen_hums_are_felt_through_a_wooden_table() -> None:
    levels = {kind: round(through_a_table(kind), 1) for kind in HUMS}
    print(levels)
    assert len(levels) == 15
    assert sum(level >= 3.0 for level in levels.values()) >= 10
    assert levels["washing_machine"] > levels["loudspeaker"] > levels["computer"]


def test_a_hum_that_no_palm_would_feel_is_left_out() -> None:
    assert through_a_table("computer") == -math.inf
    source = SceneObject(object_id="it", vibrates=Vibrates(frequency_hz=100.0, level=1.0))
    chain = [
        SceneObject(object_id=str(at), material="wood", stands_on=[str(at - 1) if at else "it"])
        for at in range(6)
    ]
    reached = [felt(each.object_id, source, *chain) for each in chain]
    assert reached[0] is not None
    assert reached[-1] is None
    assert all(hum.sensation_db() >= 0.0 for hum in reached if hum is not None)


def test_a_thick_table_hums_less_than_a_thin_one_and_no_table_is_infinite() -> None:
    thin, usual, thick, slab = (
        through_a_table("washing_machine", thickness_m=thickness_m)
        for thickness_m in (0.015, None, 0.03, 10.0)
    )
    assert thin > usual > thick > slab > -math.inf
    assert usual == pytest.approx(through_a_table("washing_machine", thickness_m=0.02))


def test_a_hum_has_its_frequency_and_its_harmonics_within_the_band_of_touch() -> None:
    samples = wave(Hum(50.0, 0.5, 0.5))
    power = np.abs(np.fft.rfft(samples * np.hanning(samples.size))) ** 2
    peaks = {hertz for hertz in range(10, 1000) if power[hertz] > 1e-3 * power.max()}

    assert {50, 100, 150} <= peaks
    assert max(peaks) <= 201


@pytest.mark.parametrize("frequency_hz", [30.0, 60.0, 120.0, 250.0])
def test_hums_of_one_level_are_felt_alike_whatever_their_frequency(frequency_hz: float) -> None:
    drive = Tone(Hum(frequency_hz, 1.0, 0.0)).render(RATE_HZ)
    threshold_db = float(np.minimum(drive_threshold_db(np.array([frequency_hz])), 24.0)[0])

    reference_db = level_db(Tone(Hum(250.0, 1.0, 0.0)).render(RATE_HZ))
    assert level_db(drive) - threshold_db == pytest.approx(reference_db, abs=0.5)


def test_a_scene_states_a_hum_and_switches_off_the_one_of_a_name() -> None:
    stated = SceneObject(object_id="box", vibrates=Vibrates(frequency_hz=80.0, level=0.4))
    off = SceneObject(
        object_id="w", name="fridge", vibrates=Vibrates(frequency_hz=50.0, level=0.1, on=False)
    )

    assert felt("box", stated) == Hum(80.0, 0.4, 0.3)
    assert felt("w", off) is None


def test_a_thing_that_is_moved_off_the_table_is_felt_there_no_more() -> None:
    session = owner(WASHING_MACHINE, TABLE)
    assert touched(session, "table") is not None
    lifted = SceneObject(object_id="w", name="washing machine")
    session.receive(scene(lifted, replace=False), 0.1)

    assert touched(session, "table") is None


@pytest.mark.parametrize("name", ["Fridge_01", "old washing machine", "purring cat", "deskFan"])
def test_a_name_says_that_a_thing_hums(name: str) -> None:
    assert hum_of(name) is not None


@pytest.mark.parametrize("name", ["cat", "phone", "kettle", "fantasy sword", "table", ""])
def test_a_name_that_does_not_say_so_hums_not(name: str) -> None:
    assert hum_of(name) is None


def test_a_hum_ends_with_its_lease() -> None:
    voices = Voices(fills_caches=False)
    hum = Hum(60.0, 0.5, 0.3)
    voices.apply(Command(0, None, "press", False, Motion(0.0, 1.0), 0, 0.5, hum=hum))
    sounding, after = voices.render(RATE_HZ // 2, 0.0), voices.render(RATE_HZ // 10, 0.5)

    assert level_db(sounding) > -60.0
    assert np.all(after[RATE_HZ // 40 :] == 0.0)
    assert voices.is_silent
