"""Defects planted by rule: the tests of each room notice them, but for those that are listed."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import defects
import mono
import pytest
from toolchains import require

# The share of a room's defects that fits four minutes. A name alone decides whether a defect is one
# of them, so that a change of the code brings in those of its own lines and no others.
NIGHTLY = {
    "edge": 0.003,
    "web": 0.022,
    "leases": 0.026,
    "stop": 0.11,
    "session": 0.0055,
    "frames": 0.03,
    "plate": 0.006,
    "speaker": 0.015,
    "core": 0.0105,
    "player_js": 0.005,
}
NEEDS = {
    "core": ("g++", "make", "doctest"),
    "player_js": ("node",),
    "player_gd": ("chromium", "godot"),
}
OPEN = 0  # a test is missing for so many of those listed; lower it with each that is written


def test_each_listed_defect_fits_the_code_and_gives_a_reason() -> None:
    listed = defects.listed()
    made = {each.name for room in defects.ROOMS for each in defects.planned(room)}
    assert sorted(set(listed) - made) == [], "the code has changed: take these out of the list"
    reasons = Counter(listed.values())
    assert set(reasons) <= {"equal", "speed", "open"}
    assert reasons["open"] <= OPEN


@pytest.mark.nightly
@pytest.mark.process
@pytest.mark.slow
@pytest.mark.parametrize("room", NIGHTLY)
def test_the_tests_of_a_room_notice_what_is_planted(room: str, tmp_path: Path) -> None:
    require(*NEEDS.get(room, ()))
    if room == "player_cs":
        mono.require()
    planned, listed = defects.planned(room, NIGHTLY[room]), defects.listed()
    chosen = [each for each in planned if each.name not in listed]
    unseen = defects.unseen(room, chosen, defects.copied(tmp_path))
    assert [f"{each.line} {each.name}" for each in unseen] == []
