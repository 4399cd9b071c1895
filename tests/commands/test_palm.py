"""The resistance of a palm on the plate as an option: a number, or a file of the calibration."""

from __future__ import annotations

import argparse

import pytest

from hapticvlm.server.options import plate_resistance


def test_a_number_is_itself():
    assert plate_resistance("1e-3") == 1e-3
    assert plate_resistance("0") == 0.0


@pytest.mark.parametrize(
    "text",
    [
        "",
        "{",
        "[]",
        "[" * 60_000,
        " " * 100_000 + "{}",
        '{"calibrate": "speaker", "plate_resistance": 1e-3}',
        '{"calibrate": "plate"}',
        '{"calibrate": "plate", "plate_resistance": true}',
        '{"calibrate": "plate", "plate_resistance": "1e-3"}',
    ],
    ids=range(9),
)
def test_another_file_is_refused_with_what_to_give(tmp_path, text):
    path = tmp_path / "palm.json"
    path.write_text(text)

    with pytest.raises(argparse.ArgumentTypeError, match="is not what"):
        plate_resistance(str(path))


@pytest.mark.parametrize("name", ["nowhere.json", "."])
def test_neither_number_nor_file_says_so(tmp_path, name):
    with pytest.raises(argparse.ArgumentTypeError, match="not a number, and as a file: "):
        plate_resistance(str(tmp_path / name))
