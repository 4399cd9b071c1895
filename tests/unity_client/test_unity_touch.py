"""Hands with a headset's motion, in the stand-in of the engine, against the real service."""

import re

import pytest

from hapticvlm.client.local_service import running

pytest_plugins = ("mono_build",)
RATES = (45, 60, 72, 90, 120)
NOBODY = "ws://127.0.0.1:9/"


@pytest.fixture(scope="module")
def service():
    with running() as service:
        yield service


@pytest.fixture
def play(build, service):
    return lambda program: build.run("components.exe", program, service.url)


def figure(said, name):
    found = re.search(rf"\b{name} (-?[\d.]+(?:E-?\d+)?)", said)
    assert found, said
    return float(found.group(1))


def test_the_speed_of_a_stroke_is_right_within_5_percent_at_every_frame_rate(build, capsys):
    said = build.run("components.exe", "speeds", NOBODY)
    with capsys.disabled():
        print("\n" + said.strip())
    assert said.count("touching True") == len(RATES)
    for rate in RATES:
        assert 0.95 < figure(said, f"least_{rate}") <= figure(said, f"most_{rate}") < 1.05


def test_carrying_a_thing_while_walking_and_turning_is_no_rubbing(play):
    said = play("carry")
    assert "holds True" in said
    assert figure(said, "walking speed") < 0.01
    assert figure(said, "walking speed [0-9.]+ level") < 0.01
    assert figure(said, "rubbing level") > 0.05  # but rubbing it is
    assert "errors 0 exceptions 0" in said


def test_a_paused_game_rests(play):
    said = play("pause")
    assert figure(said, "sliding level") > 0.05
    assert figure(said, "paused_level") < 0.005
    assert figure(said, "paused_speed") == 0.0


def test_a_teleport_is_no_stroke(build):
    said = build.run("components.exe", "teleport", NOBODY)
    assert "touching True" in said
    assert figure(said, "fastest") < 0.1


def test_the_fingers_of_a_hand_are_one_touch(play):
    said = play("fingers")
    assert "target wool True changes 0" in said
    assert "then steel True" in said
    assert figure(said, "leases_least") == 1  # the other finger's release ends nothing
    assert "let go True leases_last 0" in said
    assert figure(said, "reports") > 10


def test_how_a_hand_acts_follows_from_its_speed_or_from_a_script(play):
    said = play("gestures")
    for expected in (
        "contact_at 0.05 pattern wood press",
        "contact_at 0.4 pattern wood tap",
        "contact_at 1.5 pattern wood strike",
        "carving wood carve",
        "errors 0 exceptions 0",
    ):
        assert expected in said, said
    assert figure(said, "swinging level") > 0.01


def test_a_hand_of_many_capsules_still_nears_things(play):
    assert "approach decides metal" in play("capsules")


def test_touching_allocates_nothing_but_what_the_runtime_s_socket_does(play, capsys):
    said = play("touch-bytes")
    with capsys.disabled():
        print("\n" + said.splitlines()[0])
    assert "touching True" in said
    assert figure(said, "quiet_frames") > 100
    assert figure(said, "quiet_bytes") == 0
    assert figure(said, "touches") > 50
    assert figure(said, "bytes_of_the_socket") < 1024
