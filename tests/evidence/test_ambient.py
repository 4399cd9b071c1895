"""Ambient temperature: the scene's word, readings of pictures, or a labelled default."""

from pathlib import Path
from typing import Any

import pytest
from each_case import each
from word_tables import cases

from hapticvlm.evidence.ambient import ambient
from hapticvlm.evidence.reading import Reading


def reading(value_c: float, low_c: float, high_c: float) -> Reading:
    return Reading(value_c, low_c, high_c, prompt_sd_c=None, method="readout", seconds=0.1)


@each(case=cases(Path(__file__).with_name("values.json"), "ambients"))
def test_an_ambient_is_the_scenes_word_or_the_mean_of_readings_or_a_default(
    case: list[Any],
) -> None:
    _, stated_c, readings, (*values_c, source) = case
    told = ambient(stated_c, [reading(*each) for each in readings])
    assert [told.value_c, told.low_c, told.high_c] == pytest.approx(values_c)
    assert told.source == source
