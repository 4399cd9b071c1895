"""Approaches, the influence of layers and rigs on touches, and effects without a collider."""

import pytest

from hapticvlm.client.local_service import running

pytest_plugins = ("mono_build",)
NOBODY = "ws://127.0.0.1:9/"


@pytest.fixture
def play(build):
    return lambda program, url=NOBODY: build.run("components.exe", program, url)


def test_a_hand_nears_surfaces_and_not_the_bounding_boxes_of_rooms_and_chairs(play):
    assert "nears Table distance 0.033 closing 0.40 errors 0" in play("room")


def test_a_layer_that_cannot_be_touched_is_neither_neared_nor_felt(play):
    assert "excluded True included True" in play("excluded-layers")


def test_walking_with_a_bat_is_no_swing(play):
    assert "walking 0.00 swinging 3.00" in play("walk-with-a-bat")


def test_a_script_plays_an_effect_on_a_hand_that_touches_nothing_or_something(play):
    with running() as service:
        output = play("play", service.url)
    assert "played True unknown False" in output
    assert "still touches True leases 1 refused 0" in output
    assert "threads left 0" in output
