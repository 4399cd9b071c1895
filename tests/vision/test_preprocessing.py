"""A network's own preprocessing file: read as written, or refused by the name of the field."""

from pathlib import Path

import numpy as np
import pytest
from each_case import each_row
from tiny_encoders import PROCESSOR, picture
from word_tables import cases

from hapticvlm.vision.encoders.preprocessing import read_preprocessing

TABLES = Path(__file__).with_name("preprocessing_cases.json")


@each_row(("given", "sides"), cases(TABLES, "side"))
def test_the_side_is_what_the_file_asks_for(given, sides):
    file = {key: value for key, value in PROCESSOR.items() if key != "crop_pct"}
    found = read_preprocessing({**file, **given})
    assert (found.side, found.input_side) == tuple(sides)


def test_colours_are_scaled_and_normalised_as_the_file_states():
    found = read_preprocessing(PROCESSOR)
    pixels = np.full((1, found.side, found.side, 4), 255, np.uint8)
    pixels[..., 1] = 0
    images, masks = found.apply(pixels)
    assert images.shape == (1, 3, 112, 112)
    assert np.allclose(
        images[0, :, 5, 5], [(1 - 0.485) / 0.229, -0.456 / 0.224, (1 - 0.406) / 0.225]
    )
    assert masks.shape == (1, 112, 112)
    assert (masks == 1).all()


def test_steps_that_are_switched_off_are_left_out():
    plain = read_preprocessing({**PROCESSOR, "do_rescale": False, "do_normalize": False})
    pixels = np.full((1, plain.side, plain.side, 4), 200, np.uint8)
    assert (plain.apply(pixels)[0] == 200).all()
    unstated = {key: value for key, value in PROCESSOR.items() if key != "rescale_factor"}
    assert read_preprocessing(unstated) == read_preprocessing(PROCESSOR)


@pytest.mark.nightly
@pytest.mark.torch
def test_it_gives_the_network_what_its_own_processor_gives(tmp_path):
    import json

    from transformers import AutoImageProcessor

    (tmp_path / "preprocessor_config.json").write_text(json.dumps(PROCESSOR))
    ours = read_preprocessing(PROCESSOR)
    image = picture(1, ours.side)
    theirs = AutoImageProcessor.from_pretrained(tmp_path)(image, return_tensors="np")
    pixels = np.dstack([image, image[..., 0]])[None]
    assert np.allclose(ours.apply(pixels)[0], theirs["pixel_values"], atol=1e-5)


@each_row(("given", "complaint"), cases(TABLES, "refused"))
def test_a_file_that_asks_for_something_else_is_refused(given, complaint):
    with pytest.raises(ValueError, match=complaint):
        read_preprocessing({**PROCESSOR, **given})
