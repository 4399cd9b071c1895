"""The resistance of a palm on the plate as an option: a number, or a file of the calibration."""

from __future__ import annotations

import argparse
from pathlib import Path

import pytest
from each_case import each_row
from word_tables import words

from hapticvlm.server.options import plate_resistance

WRONG = Path(__file__).with_name("wrong_files.csv")


def test_a_number_is_itself():
    assert plate_resistance("1e-3") == 1e-3
    assert plate_resistance("0") == 0.0


@each_row(("text",), [*words(WRONG, "palm"), ("[" * 60_000,), (" " * 100_000 + "{}",)])
def test_another_file_is_refused_with_what_to_give(tmp_path, text):
    path = tmp_path / "palm.json"
    path.write_text(text)

    with pytest.raises(argparse.ArgumentTypeError, match="is not what"):
        plate_resistance(str(path))


@pytest.mark.parametrize("name", ["nowhere.json", "."])
def test_neither_number_nor_file_says_so(tmp_path, name):
    with pytest.raises(argparse.ArgumentTypeError, match="not a number, and as a file: "):
        plate_resistance(str(tmp_path / name))
