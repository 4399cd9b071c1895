"""A palm's contact resistance as an option: a number, or the file that the calibration wrote."""

from __future__ import annotations

import argparse
import json

import pytest

from hapticvlm.commands import serve
from hapticvlm.commands.main import main
from hapticvlm.server.options import contact_resistance


def test_a_number_is_itself():
    assert contact_resistance("1e-3") == 1e-3
    assert contact_resistance("0") == 0.0


def test_what_calibrate_thermal_wrote_is_read_by_feel(tmp_path, capsys):
    kept = tmp_path / "palm.json"
    calibrate = ["calibrate", "thermal", "--simulate", "1e-3", "--trials", "3", "--out", str(kept)]
    assert main(calibrate) == 0
    assert f"--contact-resistance {kept}" in capsys.readouterr().out

    assert main(["feel", "metal", "--json", "--contact-resistance", str(kept)]) == 0
    felt = json.loads(capsys.readouterr().out)["thermal"]["contact_resistance"]
    assert felt == json.loads(kept.read_text())["contact_resistance"]


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("", "is not what"),
        ("{", "is not what"),
        ("[]", "is not what"),
        ("[" * 60_000, "is not what"),
        (" " * 100_000 + "{}", "is not what"),
        ('{"calibrate": "speaker", "contact_resistance": 1e-3}', "is not what"),
        ('{"calibrate": "thermal"}', "is not what"),
        ('{"calibrate": "thermal", "contact_resistance": true}', "is not what"),
        ('{"calibrate": "thermal", "contact_resistance": "1e-3"}', "is not what"),
    ],
    ids=range(9),
)
def test_another_file_is_refused_with_what_to_give(tmp_path, text, complaint):
    path = tmp_path / "palm.json"
    path.write_text(text)

    with pytest.raises(argparse.ArgumentTypeError, match=complaint):
        contact_resistance(str(path))


@pytest.mark.parametrize("name", ["nowhere.json", "."])
def test_neither_number_nor_file_says_so(tmp_path, name):
    with pytest.raises(argparse.ArgumentTypeError, match="not a number, and as a file: "):
        contact_resistance(str(tmp_path / name))


def test_serve_takes_the_file_too(tmp_path):
    path = tmp_path / "palm.json"
    path.write_text('{"calibrate": "thermal", "contact_resistance": 2e-3}')
    parser = argparse.ArgumentParser()
    serve.add_flags(parser)

    for given in (str(path), "2e-3"):
        serving = serve.resolve_options(parser.parse_args(["--contact-resistance", given]), {})
        assert serving.contact_resistance == 2e-3


@pytest.mark.parametrize("value", ["2", "nan", "-1e-3"])
def test_feel_refuses_what_no_palm_has(tmp_path, capsys, value):
    path = tmp_path / "palm.json"
    number = "NaN" if value == "nan" else value
    path.write_text('{"calibrate": "thermal", "contact_resistance": ' + number + "}")

    for given in (value, str(path)):
        with pytest.raises(SystemExit):
            main(["feel", "metal", f"--contact-resistance={given}"])
        assert "is not within 0..1" in capsys.readouterr().err
