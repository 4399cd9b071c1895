"""Console messages for common errors, and data that must not end the process."""

import re

import mono
import pytest

from hapticvlm.client.local_service import running

pytest_plugins = ("mono_build",)
NOBODY = "ws://127.0.0.1:9/"


@pytest.fixture(scope="module")
def service():
    with running() as service:
        yield service


@pytest.fixture
def play(build, service):
    return lambda program, url=service.url: build.run("components.exe", program, url)


def console(said):
    """The lines of the engine's console."""
    return re.findall(r"^(?:log|warning|error|exception): .*$", said, re.MULTILINE)


def test_a_missing_service_is_reported_once_with_its_cure(play):
    said = play("states", NOBODY)
    (line,) = console(said)
    assert line.startswith(
        f"warning: HapticVLM: no service answers at {NOBODY}: start `hapticvlm serve`"
    )
    assert "status connecting to" in said


def test_a_wrong_token_is_reported_once_with_its_cure(play):
    with running(["--token", "secret"]) as guarded:
        (line,) = console(play("states", guarded.url))
    assert "token" in line
    assert line.startswith("warning: ")


def test_an_address_and_token_of_the_machine_outrank_the_scene_s(play):
    with running(["--token", "secret"]) as guarded:
        said = play("address", guarded.url)
    assert "remembered token secret scene yes" in said
    assert "forgotten ws://x/ " in said
    assert "this graphics API does not support readback" in said


def test_the_first_connection_is_reported_with_what_it_drives(play):
    (line,) = console(play("states"))
    assert re.search("connected to .*, speaker simulated, plate simulated", line)


def test_a_scene_that_does_not_own_the_outputs_is_told_so_with_the_cure(play):
    lines = console(play("not-owner"))
    assert "Another scene owns the outputs" in lines[0]
    assert "felt as soon as the other scene is closed" in lines[0]
    assert len(lines) == 1


def test_an_incomplete_hand_or_object_is_reported_with_its_cure(play):
    lines = console(play("incomplete"))
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
    said = play("emoji")
    assert "decided True touches True openings 1" in said
    assert "exceptions 0" in said
    assert "threads left 0" in said
    assert len(console(said)) == 1


def test_the_inspector_offers_two_hands_and_an_older_scene_s_third_is_the_right_one(play):
    said = play("other-hand")
    assert "offered Left Right decided wood side Right" in said
    assert "exceptions 0" in said


def test_a_message_that_cannot_be_written_is_one_error_and_the_link_goes_on(play):
    said = play("unsendable")
    assert "caller a touch has a hand, left or right, and a phase" in said
    assert "still decides wood openings 1 errors 1" in said
    assert [line for line in console(said) if line.startswith("error: ")] == [
        "error: HapticVLM: a message could not be sent: Interaction is not set"
    ]


def test_in_a_webgl_player_the_package_compiles_and_does_nothing(tmp_path):
    mono.require()
    own = mono.Build(tmp_path)
    for name, folders, using in (*mono.PACKAGED, *mono.PROGRAMS):
        define = "-d:UNITY_WEBGL"
        own.compile(name, mono.sources(*folders), mono.QUIET, define, using=using)
    said = own.run("components.exe", "webgl", NOBODY)
    assert "state Closed running 0" in said
    assert "exceptions 0" in said
    (line,) = console(said)
    assert "WebGL" in line
