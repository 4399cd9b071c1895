"""Hands with a headset's motion, in the stand-in of the engine, against the real service."""

import pytest
from mono import figure

pytest_plugins = ("mono_build",)
RATES = (45, 60, 72, 90, 120)
NOBODY = "ws://127.0.0.1:9/"


def test_the_speed_of_a_stroke_is_right_within_5_percent_at_every_frame_rate(play, capsys):
    output = play("Moves.Speeds", NOBODY)
    with capsys.disabled():
        print("\n" + output.strip())
    assert output.count("touching True") == len(RATES)
    for rate in RATES:
        assert 0.95 < figure(output, f"least_{rate}") <= figure(output, f"most_{rate}") < 1.05


def test_carrying_a_thing_while_walking_and_turning_is_no_rubbing(play):
    output = play("Moves.Carry")
    assert "holds True" in output
    assert figure(output, "walking speed") < 0.01
    assert figure(output, "walking speed [0-9.]+ level") < 0.01
    assert figure(output, "rubbing level") > 0.05  # but rubbing it is
    assert "errors 0 exceptions 0" in output


def test_a_paused_game_rests(play):
    output = play("Moves.Pause")
    assert figure(output, "sliding level") > 0.05
    assert figure(output, "paused_level") < 0.005
    assert figure(output, "paused_speed") == 0.0


def test_a_teleport_is_no_stroke(play):
    output = play("Moves.Teleport", NOBODY)
    assert "touching True" in output
    assert figure(output, "fastest") < 0.1


def test_the_fingers_of_a_hand_are_one_touch(play):
    output = play("Moves.Fingers")
    assert "target wool True changes 0" in output
    assert "then steel True" in output
    assert figure(output, "leases_least") == 1  # the other finger's release ends nothing
    assert "let go True leases_last 0" in output
    assert figure(output, "reports") > 10


def test_how_a_hand_acts_follows_from_its_speed_or_from_a_script(play):
    output = play("Moves.Gestures")
    for expected in (
        "contact_at 0.05 pattern wood press",
        "contact_at 0.4 pattern wood tap",
        "contact_at 1.5 pattern wood strike",
        "carving wood carve",
        "errors 0 exceptions 0",
    ):
        assert expected in output, output
    assert figure(output, "swinging level") > 0.01


def test_a_hand_of_many_capsules_still_nears_things(play):
    assert "approach decides metal" in play("Moves.Capsules")


@pytest.mark.nightly
def test_touching_allocates_nothing_but_what_the_runtime_s_socket_does(play, capsys):
    output = play("Moves.TouchBytes")
    with capsys.disabled():
        print("\n" + output.splitlines()[0])
    assert "touching True" in output
    assert figure(output, "quiet_frames") > 100
    assert figure(output, "quiet_bytes") == 0
    assert figure(output, "touches") > 50
    assert figure(output, "bytes_of_the_socket") < 1024
