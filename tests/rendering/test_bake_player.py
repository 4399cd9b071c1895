"""The reference player of a feel file: beside the service, its golden vectors, hostile cases."""

from __future__ import annotations

import itertools
import json
import math
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import jsonschema
import numpy as np
import pytest
from numpy.typing import NDArray

from hapticvlm.materials import MATERIALS
from hapticvlm.rendering.vibration.sound_voice import as_sound
from hapticvlm.rendering.vibration.vibration import IMPACTS, INTERACTIONS, RATE_HZ, VOICES, Motion
from hapticvlm.rendering.vibration.vibration_plan import VibrationPlanner
from hapticvlm.rendering.vibration.voices import DELAY_S, Command, Voices

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT / "schemas"), str(ROOT / "examples")]

from bake_player import Player  # noqa: E402
from feel_file import TEXTURES, opened  # noqa: E402

import player_vectors as vectors  # noqa: E402

Json = dict[str, Any]
Wave = NDArray[np.float64]
VECTORS = ROOT / "schemas" / "vectors"
HOSTILE: Json = json.loads((VECTORS / "player_hostile.json").read_text())
FILES: dict[str, Json] = {
    voice: json.loads((VECTORS / f"feel.{voice}.json").read_text()) for voice in VOICES
}
FEELS = {voice: opened(file) for voice, file in FILES.items()}
SAME = {"level_varies": 0.0, "pitch_varies": 0.0}  # equal blows are equal
STEADY = {voice: {**feel, "rules": {**feel["rules"], **SAME}} for voice, feel in FEELS.items()}
MAX_BYTES = 250_000
BLOCK = RATE_HZ // 100
SPEEDS_MPS = (0.1, 0.2, 0.4, 0.8, 1.5)
FORCES_N = (0.5, 1.5, 5.0)
# No two touches are equal, so the mean of some is compared, of the service and of the player. Even
# and odd seeds of the service beside each other are the floor of the comparison.
SEEDS = {"slide": (4, 2), "carve": (4, 2), "swing": (8, 8), "press": (8, 3)}
OCTAVE_STEPS = np.arange(0.0, 8.0, 1.0 / 24.0)  # from 20 Hz
# What is off by more than the marks, as docs/player.md says: 99 % of levels, dB, and of pitches.
BEYOND = {
    ("true", "press"): (vectors.STEP_DB, 0.07),
    ("sound", "press"): (4.4, 0.17),
    ("sound", "slide"): (2.0, 0.11),
    ("sound", "carve"): (vectors.STEP_DB, 0.1),
    ("sound", "swing"): (2.4, vectors.MOST_PITCH),
}


@pytest.mark.parametrize("voice", VOICES)
def test_a_file_of_all_materials_keeps_its_schema_and_its_size(voice: str) -> None:
    schema = json.loads((ROOT / "schemas/feel_clips.schema.json").read_text())
    jsonschema.Draft202012Validator(schema).validate(FILES[voice])
    assert (VECTORS / f"feel.{voice}.json").stat().st_size <= MAX_BYTES


def test_the_player_renders_as_its_golden_vectors_say() -> None:
    cases = json.loads((VECTORS / "player_sound.json").read_text())
    for case in [*cases[:: len(cases) // 12], cases[-1]]:
        wave = vectors.rendered(FEELS[case["voice"]], case)
        assert vectors.problems(case, wave) == []


@pytest.mark.parametrize("case", HOSTILE["touches"], ids=lambda case: case["name"])
def test_a_hostile_touch_is_felt_as_the_one_that_the_service_would_feel(case: Json) -> None:
    plan, said = played(case["touch"], case.get("surface"), case.get("gain", 1.0))
    wanted, _ = played(case["like"], case.get("like_surface"), case.get("like_gain", 1.0))
    assert plan == wanted
    assert said == ({case["says"]} if case["says"] else set())
    taken = case["service"]
    if taken is not None and case["like"]:
        assert {name: case["like"][name] for name in taken} == taken


@pytest.mark.parametrize("case", HOSTILE["times"], ids=lambda case: case["name"])
def test_a_time_that_is_not_in_seconds_is_named(case: Json) -> None:
    player = Player(FEELS["true"], lambda _: {"material": "wood"}, say=str)
    touch = {"phase": case.get("phase", "slide"), "hand": "right", **vectors.MOTION}
    for now in map(vectors.unmarked, case["times"]):
        player.touch(touch, now)
        plan = player.plan("right", "parametric", now)
        assert all(map(math.isfinite, plan["amplitude"] + plan["frequency_hz"]))
    assert player.said == ({case["says"]} if case["says"] else set())


@pytest.mark.parametrize("case", HOSTILE["calls"], ids=str)
def test_a_call_of_an_unknown_hand_or_form_is_refused_in_words(case: Json) -> None:
    said: list[str] = []
    player = Player(FEELS["true"], lambda _: {"material": "wood"}, say=said.append)
    player.touch({"phase": "slide", "hand": "right", **vectors.MOTION}, 5.0)
    assert player.plan(case["hand"], case["form"], 5.02)["amplitude"] == []
    assert vectors.said(said) == vectors.says(case)


@pytest.mark.parametrize("case", HOSTILE["files"], ids=lambda case: case["name"])
def test_a_wrong_file_is_refused_with_its_field(case: Json) -> None:
    with pytest.raises(ValueError, match=r".") as refusal:
        opened(vectors.edited(FILES["true"], case))
    assert str(refusal.value).startswith(case["field"])


def test_no_touch_of_a_grid_gives_a_number_out_of_range() -> None:
    for case in vectors.grid():
        plan, _ = played(case["touch"], case.get("surface"), case.get("gain", 1.0))
        assert vectors.is_in_range(plan), case


def test_a_contact_is_felt_in_the_block_after_it() -> None:
    for voice in VOICES:
        player = Player(FEELS[voice], lambda _: {"material": "glass"}, 48_000, str)
        player.render(480, 0.0)
        player.touch({"phase": "contact", "hand": "right", **vectors.MOTION}, 0.01)
        assert np.abs(player.render(480, 0.01)).max() > 0.05


def test_a_touch_that_is_not_renewed_fades_within_20_ms_of_its_lease() -> None:
    player = Player(FEELS["true"], lambda _: {"material": "wood"}, 48_000, str)
    player.touch({"phase": "slide", "hand": "right", **vectors.MOTION}, 0.0)
    blocks = [player.render(480, 0.01 * number) for number in range(30)]
    assert np.abs(blocks[24]).max() > 0.01
    assert not np.abs(blocks[27]).any()


def test_equal_blows_of_the_player_differ_in_level_as_those_of_the_service() -> None:
    waves = [of_the_player(FEELS["true"], "wood", "tap", Motion(0.4, 1.5), n) for n in range(12)]
    assert 0.5 < np.std([10.0 * math.log10(np.mean(wave**2)) for wave in waves]) < 1.6


@pytest.mark.parametrize("kind", INTERACTIONS)
def test_the_player_is_within_a_step_of_the_service(kind: str) -> None:
    for row in compared(kind, ("glass", "wood"), (0.4,), (1.5,)):
        assert abs(row.level_db) <= vectors.MOST_DB
        assert abs(row.onset_s) <= vectors.MOST_ONSET_S


@pytest.mark.parametrize("kind", INTERACTIONS)
def test_a_plan_begins_with_the_service_s_own_and_is_as_strong(kind: str) -> None:
    planner, plans = VibrationPlanner(MATERIALS), np.zeros((2, 6, 9, 8))
    for seed, at in itertools.product(range(6), range(9)):
        if not at:
            planner.rest()
            player = Player(FEELS["true"], lambda _: {"material": "glass"}, None, str)
            [player.draw() for _ in range(5 * seed)]
        now, onset = 2.0 * seed + 0.1 * at, not at and kind != "swing"
        if onset or kind in TEXTURES:
            command = Command(1, "glass", kind, onset, Motion(**vectors.MOTION), seed, now + 0.25)
            planner.apply(command, now)
            phase = "approach" if kind == "swing" else "contact" if onset else "slide"
            touch = {"phase": phase, "hand": "right", "interaction": kind, **vectors.MOTION}
            player.touch(touch, now)
        theirs = planner.plan("amplitude", now).amplitude
        mine = player.plan("right", "amplitude", now)["amplitude"]
        plans[0, seed, at, : len(theirs)], plans[1, seed, at, : len(mine)] = theirs, mine
    begins = np.argmax(plans[:, :, 0] > 0.0, axis=2)
    assert kind == "swing" or (begins[0] == begins[1]).all()  # a swing swells
    for part, most in (
        (plans[:, :, 0].max(axis=2), 0.1),
        (plans[:, :, 1:].mean(axis=(2, 3)), 0.05),
    ):
        assert abs(np.subtract(*part.mean(axis=1))) < most


@pytest.mark.nightly
@pytest.mark.parametrize("kind", INTERACTIONS)
def test_the_player_is_within_its_marks_on_every_material_speed_and_force(kind: str) -> None:
    """`pytest -s -m nightly` prints the table of docs/player.md."""
    forces = (1.5,) if kind == "swing" else FORCES_N  # air has no force
    rows = compared(kind, tuple(MATERIALS), SPEEDS_MPS, forces)
    off: list[str] = []
    for voice in VOICES:
        mine = np.abs([row[1:] for row in rows if row.voice == voice])
        level, pitch, onset, level_floor, pitch_floor = np.quantile(mine, 0.99, axis=0)
        print(
            f"| {kind} | {voice} | {np.median(mine[:, 0]):.1f} | {level:.1f} ({level_floor:.1f}) "
            f"| {100 * pitch:.0f} ({100 * pitch_floor:.0f}) | {1000 * onset:.1f} |"
        )
        most_db, most_pitch = BEYOND.get((voice, kind), (vectors.STEP_DB, vectors.MOST_PITCH))
        for name, value, most in (
            ("level", level, max(most_db, level_floor)),
            ("largest level", mine[:, 0].max(), max(vectors.MOST_DB, most_db, mine[:, 3].max())),
            ("pitch", pitch, max(most_pitch, pitch_floor)),
            ("onset", mine[:, 2].max(), vectors.MOST_ONSET_S),
        ):
            if value > most:
                off.append(f"{voice} {kind}: {name} is off by {value:.3g}, the mark is {most:.3g}")
    assert off == []


class Row(NamedTuple):
    """How far the player is from the service, and the service from itself with other seeds."""

    voice: str
    level_db: float
    pitch: float
    onset_s: float
    level_floor_db: float
    pitch_floor: float


def played(touch: Json | None, surface: Json | None, gain: object) -> tuple[Json, set[str]]:
    """Return the plan 20 ms after a touch, and the fields that the player has named."""
    surface = {"material": "wood"} if surface is None else vectors.unmarked(surface)
    player = Player(FEELS["true"], lambda _: surface, say=str)
    player.gain = vectors.unmarked(gain)
    if touch is not None:
        player.touch(vectors.unmarked(touch), 5.0)
    hand = (touch or {}).get("hand", "right")
    return player.plan(hand, "parametric", 5.02), player.said


def compared(
    kind: str, materials: tuple[str, ...], speeds: tuple[float, ...], forces: tuple[float, ...]
) -> list[Row]:
    times = 5.0 if kind == "swing" else 1.0
    cases = itertools.product(materials, speeds, forces)
    return [
        row
        for name, speed, force in cases
        for row in compared_touch(name, kind, Motion(times * speed, force))
    ]


def compared_touch(material: str, kind: str, motion: Motion) -> Iterator[Row]:
    begin = 0 if kind in IMPACTS else RATE_HZ // 5
    of_service, of_player = SEEDS.get(kind, (16, 1))
    own = [of_the_service(material, kind, motion, seed) for seed in range(of_service)]
    for voice in VOICES:
        voiced = [as_sound(wave) if voice == "sound" else wave for wave in own]
        waves = [wave[round(DELAY_S * RATE_HZ) :].astype(np.float64) for wave in voiced]
        theirs = [of_the_player(STEADY[voice], material, kind, motion, n) for n in range(of_player)]
        halves = [spectrum([wave[begin:] for wave in waves[half::2]]) for half in (0, 1)]
        heard = [spectrum([wave[begin:] for wave in theirs]), (halves[0] + halves[1]) / 2, *halves]
        level, pitch = (list(map(figure, heard)) for figure in (strongest_db, pitch_hz))
        onset_s = np.median([*map(first, theirs)]) - np.median([*map(first, waves)])
        yield Row(
            voice,
            level[0] - level[1],
            pitch[0] / pitch[1] - 1.0,
            float(onset_s) if kind in IMPACTS else 0.0,
            level[2] - level[3],
            pitch[2] / pitch[3] - 1.0,
        )


def of_the_service(material: str, kind: str, motion: Motion, seed: int) -> NDArray[np.float32]:
    voices = Voices(1.0, MATERIALS, fills_caches=False)
    wave = []
    for block in range(blocks(kind)):
        if is_renewed(kind, block):
            onset = block == 0 and kind != "swing"
            ends = 0.01 * block + 0.25
            voices.apply(Command(1, material, kind, onset, motion, seed, ends))
        wave.append(voices.render(BLOCK, 0.01 * block))
    return np.concatenate(wave)


def of_the_player(feel: Json, material: str, kind: str, motion: Motion, number: int) -> Wave:
    player = Player(feel, lambda _: {"material": material}, RATE_HZ, str)
    for _ in range(5 * number):
        player.draw()
    wave = []
    for block in range(blocks(kind)):
        if is_renewed(kind, block):
            phase = "contact" if not block or kind in IMPACTS else "slide"
            phase = "approach" if kind == "swing" else phase
            touch = {"phase": phase, "hand": "right", "interaction": kind}
            moved = {"speed_mps": motion.speed_mps, "force_n": motion.force_n}
            player.touch({**touch, **moved}, 0.01 * block)
        wave.append(player.render(BLOCK, 0.01 * block))
    return np.concatenate(wave)[: -round(DELAY_S * RATE_HZ)]


def blocks(kind: str) -> int:
    return 12 if kind in ("tap", "strike") else 30 if kind == "press" else 120


def is_renewed(kind: str, block: int) -> bool:
    return block % 8 == 0 and (block == 0 or kind not in ("tap", "strike"))


def spectrum(waves: list[Wave]) -> Wave:
    """Return the mean power at each Hz."""
    return np.asarray(
        np.mean([np.abs(np.fft.rfft(w[:RATE_HZ], RATE_HZ)) ** 2 for w in waves], axis=0)
    )


def strongest_db(power: Wave) -> float:
    """Return the level of the strongest third octave, wherever it lies."""
    sums = np.concatenate(([0.0], np.cumsum(power)))
    begins, ends = (
        np.interp(20.0 * 2.0 ** (OCTAVE_STEPS + more), np.arange(sums.size) - 0.5, sums)
        for more in (0.0, 1.0 / 3.0)
    )
    return 10.0 * math.log10(float((ends - begins).max()))


def pitch_hz(power: Wave) -> float:
    hertz = np.arange(20, 6000)
    heard = power[hertz]
    return math.exp(float(heard @ np.log(hertz) / heard.sum()))


def first(wave: Wave) -> float:
    return float(np.argmax(np.abs(wave) > 0.1 * np.abs(wave).max())) / RATE_HZ
