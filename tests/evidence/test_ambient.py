"""Ambient temperature: the scene's word, or a labelled default."""

from hapticvlm.evidence.ambient import ambient


def test_the_scene_is_taken_at_its_word_and_zero_degrees_is_one() -> None:
    for stated_c in (-3.5, 0.0):
        told = ambient(stated_c)
        assert (told.value_c, told.low_c, told.high_c, told.source) == (*3 * (stated_c,), "scene")


def test_the_default_is_labelled_and_has_an_interval() -> None:
    assumed = ambient(None)
    assert assumed.source == "default"
    assert assumed.value_c == 22.0
    assert assumed.low_c < assumed.value_c < assumed.high_c
