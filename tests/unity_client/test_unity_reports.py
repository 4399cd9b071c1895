"""Console messages for common errors, and data that must not end the process."""

import re

import mono
import pytest

from hapticvlm.client.local_service import running

pytest_plugins = ("mono_build",)
NOBODY = "ws://127.0.0.1:9/"


def console(output):
    """The lines of the engine's console, without those that say what is felt meanwhile."""
    lines = re.findall(r"^(?:log|warning|error|exception): .*$", output, re.MULTILINE)
    return [line for line in lines if "felt from the" not in line]


def test_a_missing_service_is_reported_once_with_its_cure(play):
    output = play("Reports.States", NOBODY)
    (line,) = console(output)
    assert line.startswith(
        f"warning: HapticVLM: no service answers at {NOBODY}: start `hapticvlm serve`"
    )
    assert "status connecting to" in output


def test_a_wrong_token_is_reported_once_with_its_cure(play):
    with running(["--token", "secret"]) as guarded:
        (line,) = console(play("Reports.States", guarded.url))
    assert "token" in line
    assert line.startswith("warning: ")


def test_an_address_and_token_of_the_machine_outrank_the_scene_s(play):
    with running(["--token", "secret"]) as guarded:
        output = play("Reports.Address", guarded.url)
    assert "remembered token secret scene yes" in output
    assert "forgotten ws://x/ " in output
    assert "this graphics API does not support readback" in output


def test_the_first_connection_is_reported_with_what_it_drives(play):
    (line,) = console(play("Reports.States"))
    assert re.search("connected to .*, speaker simulated, plate simulated", line)


def test_a_scene_that_does_not_own_the_outputs_is_told_so_with_the_cure(play):
    lines = console(play("Reports.NotOwner"))
    assert "Another scene owns the outputs" in lines[0]
    assert "felt as soon as the other scene is closed" in lines[0]
    assert len(lines) == 1


def test_an_incomplete_hand_or_object_is_reported_with_its_cure(play):
    lines = console(play("Reports.Incomplete", NOBODY))
    assert len(lines) == 5
    for name, cure in (
        ("bare", "add a Sphere Collider"),
        ("still", "add one and tick Is Kinematic"),
        ("solid", "tick Is Trigger"),
        ("ghost", "add a Box Collider"),
        ("apart", "its layer 'Hands' collides with the layer of no Haptic Object"),
    ):
        assert any(f"'{name}'" in line and cure in line for line in lines), name


def test_half_an_emoji_ends_nothing(play):
    output = play("Reports.Emoji")
    assert "decided True touches True openings 1" in output
    assert "exceptions 0" in output
    # A busy machine may answer late, and is told so.
    assert len([line for line in console(output) if "Retrying" not in line]) == 1


def test_the_inspector_offers_two_hands_and_an_older_scene_s_third_is_the_right_one(play):
    output = play("Reports.OtherHand")
    assert "offered Left Right decided wood side Right" in output
    assert "exceptions 0" in output


def test_a_message_that_cannot_be_written_is_one_error_and_the_link_goes_on(play):
    output = play("Reports.Unsendable")
    assert "caller a touch has a hand, left or right, and a phase" in output
    assert "still decides wood openings 1 errors 1" in output
    assert [line for line in console(output) if line.startswith("error: ")] == [
        "error: HapticVLM: a message could not be sent: Interaction is not set"
    ]


@pytest.mark.nightly
def test_in_a_webgl_player_the_package_compiles_and_does_nothing(tmp_path):
    mono.require()
    own = mono.Build(tmp_path)
    for name, folders, using in (*mono.PACKAGED, *mono.PROGRAMS):
        define = "-d:UNITY_WEBGL"
        own.compile(name, mono.sources(*folders), mono.QUIET, define, using=using)
    output = own.run("components.exe", "Reports.WebGl", NOBODY)
    assert "state Closed running 0" in output
    assert "exceptions 0" in output
    (line,) = console(output)
    assert "WebGL" in line
