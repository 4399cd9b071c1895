"""The reference player of a feel file: beside the service, its golden vectors, hostile cases."""

from __future__ import annotations

import json
import math
import sys
from itertools import pairwise
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
from numpy.typing import NDArray

from hapticvlm.materials import MATERIALS
from hapticvlm.rendering.vibration.perceived_level import THIRD_OCTAVES_HZ
from hapticvlm.rendering.vibration.sound_voice import as_sound
from hapticvlm.rendering.vibration.vibration import IMPACTS, INTERACTIONS, RATE_HZ, VOICES, Motion
from hapticvlm.rendering.vibration.voices import DELAY_S, Command, Voices

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT / "schemas"), str(ROOT / "examples")]

from bake_player import Player  # noqa: E402
from feel_file import opened  # noqa: E402

import player_vectors as vectors  # noqa: E402

Json = dict[str, Any]
Wave = NDArray[np.float64]
VECTORS = ROOT / "schemas" / "vectors"
HOSTILE: Json = json.loads((VECTORS / "player_hostile.json").read_text())
FILES: dict[str, Json] = {
    voice: json.loads((VECTORS / f"feel.{voice}.json").read_text()) for voice in VOICES
}
FEELS = {voice: opened(file) for voice, file in FILES.items()}
MAX_BYTES = 250_000
BLOCK = RATE_HZ // 100
SEEDS = 3  # no two impacts are equal: the mean of some is compared


@pytest.mark.parametrize("voice", VOICES)
def test_a_file_of_all_materials_keeps_its_schema_and_its_size(voice: str) -> None:
    schema = json.loads((ROOT / "schemas/feel_clips.schema.json").read_text())
    jsonschema.Draft202012Validator(schema).validate(FILES[voice])
    assert (VECTORS / f"feel.{voice}.json").stat().st_size <= MAX_BYTES


def test_the_player_renders_as_its_golden_vectors_say() -> None:
    cases = json.loads((VECTORS / "player_sound.json").read_text())
    for case in cases[:: len(cases) // 12]:
        player = Player(FEELS[case["voice"]], vectors._surface, vectors.RATE_HZ, str)
        assert vectors.problems(case, vectors.rendered(player, case)) == []


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
    touch = {"phase": "slide", "hand": "right", **vectors.MOTION}
    for now in map(vectors.unmarked, case["times"]):
        player.touch(touch, now)
        plan = player.plan("right", "parametric", now)
        assert all(map(math.isfinite, plan["amplitude"] + plan["frequency_hz"]))
    assert player.said == ({case["says"]} if case["says"] else set())


@pytest.mark.parametrize("case", HOSTILE["files"], ids=lambda case: case["name"])
def test_a_wrong_file_is_refused_with_its_field(case: Json) -> None:
    with pytest.raises(ValueError, match=r".") as refusal:
        opened(vectors.edited(FILES["true"], case))
    assert str(refusal.value).startswith(case["field"])


def test_no_touch_of_a_grid_gives_a_number_that_is_not_finite() -> None:
    numbers = (0.4, math.nan, math.inf, -math.inf, -1.0, 1e300, None)
    for kind in (None, *INTERACTIONS):
        for speed in numbers:
            for force in numbers:
                touch = {"phase": "contact", "hand": "left", "interaction": kind}
                plan, _ = played({**touch, "speed_mps": speed, "force_n": force}, None, 1.0)
                assert all(0.0 <= value <= 1.0 for value in plan["amplitude"])
                assert all(map(math.isfinite, plan["frequency_hz"]))


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


@pytest.mark.nightly
def test_the_player_is_within_a_step_of_the_service_on_every_material() -> None:
    rows = [row for kind in ("tap", "slide") for row in compared("true", kind, (0.4,), (1.5,))]
    off = np.abs([row[1] for row in rows])
    assert np.quantile(off, 0.9) <= vectors.STEP_DB
    assert off.max() <= vectors.MOST_DB


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
    voice: str, kind: str, speeds: tuple[float, ...], forces: tuple[float, ...]
) -> list[tuple[str, float, float, float]]:
    """Return (touch, level dB, pitch as a share, onset ms) of the player beside the service."""
    rows = []
    for material in MATERIALS:
        for speed in speeds:
            for force in forces:
                motion = Motion(speed * (5.0 if kind == "swing" else 1.0), force)
                own = [of_the_service(voice, material, kind, motion, seed) for seed in range(SEEDS)]
                theirs = [of_the_player(voice, material, kind, motion, n) for n in range(SEEDS)]
                begin = 0 if kind in IMPACTS else RATE_HZ // 5
                one, other = (
                    np.sum([bands(wave[begin:]) for wave in w], axis=0) for w in (own, theirs)
                )
                level_db = 10.0 * math.log10(other.max() / one.max())
                onsets = [first(w[0]) for w in (theirs, own)]
                onset_ms = 1000.0 * (onsets[0] - onsets[1]) if kind in IMPACTS else 0.0
                name = f"{material} {motion.speed_mps:g} m/s {force:g} N"
                rows.append((name, level_db, pitch(other) / pitch(one) - 1.0, onset_ms))
    return rows


def of_the_service(voice: str, material: str, kind: str, motion: Motion, seed: int) -> Wave:
    voices = Voices(1.0, MATERIALS, fills_caches=False)
    wave = []
    for block in range(blocks(kind)):
        if is_renewed(kind, block):
            onset = block == 0 and kind != "swing"
            ends = 0.01 * block + 0.25
            voices.apply(Command(1, material, kind, onset, motion, seed, ends))
        wave.append(voices.render(BLOCK, 0.01 * block))
    heard = np.concatenate(wave)
    heard = as_sound(heard) if voice == "sound" else heard
    return heard[round(DELAY_S * RATE_HZ) :].astype(np.float64)


def of_the_player(voice: str, material: str, kind: str, motion: Motion, number: int) -> Wave:
    player = Player(FEELS[voice], lambda _: {"material": material}, RATE_HZ, str)
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


def bands(wave: Wave) -> Wave:
    """Return the power in each third octave, from that of the palm up to 5 kHz."""
    edges = np.array(THIRD_OCTAVES_HZ[0]) * 2.0 ** ((np.arange(25) - 0.5) / 3.0)
    power = np.abs(np.fft.rfft(wave)) ** 2 / wave.size
    begins = np.searchsorted(np.fft.rfftfreq(wave.size, 1.0 / RATE_HZ), edges)
    return np.array([power[a:b].sum() for a, b in pairwise(begins)])


def pitch(power: Wave) -> float:
    return float(np.exp((power * np.arange(power.size)).sum() / power.sum() * math.log(2.0) / 3.0))


def first(wave: Wave) -> float:
    return float(np.argmax(np.abs(wave) > 0.1 * np.abs(wave).max())) / RATE_HZ
