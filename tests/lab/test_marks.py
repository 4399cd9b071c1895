"""The table of marks: measured by one command, and put into the page of figures by it alone."""

import json

import pytest

from hapticvlm.errors import UsageError
from hapticvlm_lab.bench import marks
from hapticvlm_lab.bench.marks import BEGIN, END, Mark, as_table, put

DOCUMENT = f"# Measured\n\n{BEGIN}\nan old table\n{END}\n\nMore.\n"


def test_what_is_above_its_mark_is_bold_and_what_keeps_it_is_not():
    kept, missed = Mark("a start", "s", 0.9, 0.71), Mark("a touch", "", 1.15, 1.3)
    table = as_table([kept, missed])
    assert "| a start, s | 0.9 | 0.71 |" in table
    assert "| a touch | 1.15 | **1.3** |" in table


def test_a_new_table_takes_the_place_of_the_old_one_and_nothing_else_changes():
    found = put(DOCUMENT, "a new table")
    assert found == DOCUMENT.replace("an old table", "a new table")
    assert put(found, "a new table") == found


def test_a_document_without_the_comments_is_refused():
    with pytest.raises(UsageError, match="lacks the comments"):
        put("# Measured\n", "a table")


def test_the_table_in_the_document_names_the_marks_that_are_measured_today():
    text = marks.DOCUMENT.read_text(encoding="utf-8")
    table = text.partition(BEGIN)[2].partition(END)[0]
    rows = [line for line in table.splitlines() if line.startswith("| ")]
    assert len(rows) == 12  # with the head
    assert "| start until ready, best of 3, s | 0.9 |" in table


@pytest.mark.nightly
@pytest.mark.process
def test_every_mark_is_measured(capsys, monkeypatch):
    monkeypatch.setattr(marks, "SECONDS", 0.5)
    monkeypatch.setattr(marks, "REST_S", 0.5)
    monkeypatch.setattr(marks, "STARTS", 1)
    monkeypatch.setattr(marks, "ROUNDS", 5)
    assert marks.run(write=False, as_json=True) == 0
    rows = json.loads(capsys.readouterr().out)["rows"]
    assert len(rows) == 11
    assert all(0.0 <= row["now"] < 1e4 for row in rows)
    assert all(row["met"] == (row["now"] <= row["most"]) for row in rows)
