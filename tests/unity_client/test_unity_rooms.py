"""Approaches, the influence of layers and rigs on touches, and effects without a collider."""

pytest_plugins = ("mono_build",)
NOBODY = "ws://127.0.0.1:9/"


def test_a_hand_nears_surfaces_and_not_the_bounding_boxes_of_rooms_and_chairs(play):
    assert "nears Table distance 0.033 closing 0.40 errors 0" in play("Rooms.Room", NOBODY)


def test_a_layer_that_cannot_be_touched_is_neither_neared_nor_felt(play):
    assert "excluded True included True" in play("Rooms.Layers", NOBODY)


def test_walking_with_a_bat_is_no_swing(play):
    assert "walking 0.00 swinging 3.00" in play("Rooms.Bat", NOBODY)


def test_a_script_plays_an_effect_on_a_hand_that_touches_nothing_or_something(play):
    output = play("Rooms.Effects")
    assert "played True unknown False" in output
    assert "still touches True leases 1 refused 0" in output
