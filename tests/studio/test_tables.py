"""Tables as their readers read them: pandas gives back each cell that the product wrote."""

import io
from itertools import product
from pathlib import Path

import msgspec
import pandas as pd
import pytest

from hapticvlm_studio.design.design import check_code
from hapticvlm_studio.design.form import NOTHING, Question
from hapticvlm_studio.design.stimuli import Stimulus, StudyError
from hapticvlm_studio.report import results
from hapticvlm_studio.report.results import Person, Results, Row

GLASS = Stimulus("glass", "tap", "cold", "glass", "tap", 20.0)
PIECES = ("", *"071-_eEdxFP", "na", "NA", "inf", "TRUE", "None")
CODES = ["".join(parts) for parts in product(PIECES, repeat=3)]
DATES = ("MAR1", "3-4", "1-MAY", "Sept-2024", "2024-01-02")
ANSWERS = ("NA", "None", "null", "=1+1", "-1", "a, b", '"', "two\nlines", "é ü 文", " x ", None)


def is_taken(code: str) -> bool:
    try:
        check_code(code)
    except StudyError:
        return False
    return True


def test_a_code_that_is_taken_is_the_same_in_pandas() -> None:
    taken = sorted(filter(is_taken, set(CODES)))
    table = ",".join(f"c{at}" for at in range(len(taken))) + "\n" + ",".join(taken)
    read = pd.read_csv(io.StringIO(table)).iloc[0]
    assert [code for code, cell in zip(taken, read, strict=True) if cell != code] == []
    assert len(taken) > len(CODES) / 4


@pytest.mark.parametrize(
    "code", ["NA", "None", "null", "TRUE", "1E5", "007", "-1", "7L", "0x1p3", *DATES]
)
def test_a_code_that_a_table_changes_is_refused_with_one_that_is_taken(code: str) -> None:
    with pytest.raises(StudyError, match=code) as refused:
        check_code(code)
    assert is_taken(str(refused.value).split()[-1])


def test_every_cell_of_a_study_comes_back(tmp_path: Path) -> None:
    names = [f"q{at}" for at in range(len(ANSWERS))]
    form = msgspec.structs.replace(NOTHING, question=tuple(Question(n, {}, "text") for n in names))
    words = ("tap", "cold", "glass", "glass", "tap", "cold")
    row = Row("P-007", 0, 0, 1, *words, True, 1.25, None, 0.1 + 0.2)
    people = (Person("P-007", "en", dict(zip(names, ANSWERS, strict=True))),)
    study = Results((GLASS,), (row,), ("P-007",), 1, True, 0, form, people, False)

    results.write_csv(tmp_path / "trials.csv", study)
    trials = pd.read_csv(tmp_path / "trials.csv").iloc[0]
    written = {name: getattr(row, name) for name in trials.index}
    assert {name: None if pd.isna(cell) else cell for name, cell in trials.items()} == written
    results.write_people(tmp_path / "participants.csv", study)
    answered = pd.read_csv(tmp_path / "participants.csv").iloc[0][names]
    cells = [None if pd.isna(cell) else cell.removeprefix("'") for cell in answered]
    assert cells == list(ANSWERS)
