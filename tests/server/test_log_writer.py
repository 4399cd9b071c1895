"""Whoever chose the words of a log line, it stays one line that no terminal obeys."""

import logging

import pytest

from hapticvlm.errors import one_line, printable
from hapticvlm.server.log_writer import FORMAT, PrintableFormatter

HOSTILE = "mug\x1b]0;owned\x07\nERROR forged: line\r\x9b31m \u202egnp.exe\u2066"


def formatted(*arguments, error=None):
    info = None if error is None else (type(error), error, error.__traceback__)
    record = logging.LogRecord("x", logging.INFO, "f", 1, "%s said: %s", arguments, info)
    return PrintableFormatter(FORMAT).format(record)


def test_a_name_with_escape_codes_line_breaks_and_bidi_marks_is_one_plain_line():
    line = formatted("observer", HOSTILE)
    assert line.isprintable()
    assert "mug" in line


def test_a_line_of_any_length_is_cut():
    assert len(formatted("observer", "x" * 1_000_000)) < 600 + 100


def test_a_traceback_keeps_its_lines_and_nothing_else():
    try:
        raise ValueError(HOSTILE)
    except ValueError as error:
        lines = formatted("a", "b", error=error).split("\n")
    assert any("Traceback" in line for line in lines)
    assert all(line.isprintable() for line in lines)


@pytest.mark.parametrize("text", [HOSTILE, "", "\n\n"])
def test_an_error_is_one_printable_line(text):
    assert one_line(ValueError(text)).isprintable()
    assert one_line(ValueError(text))


def test_plain_words_stay_as_they_are():
    assert printable("Größe 20 °C, 3 µm") == "Größe 20 °C, 3 µm"
