"""The measure of names of real scenes: what it counts, leaves out, fits and refuses."""

from pathlib import Path

import pytest

from hapticvlm import materials
from hapticvlm.evidence.lexicon import read_lexicon
from hapticvlm_lab.bench.scene_names import bins, fit, read, run, score

HEADER = "scene,name,expected\n"
LEXICON = read_lexicon(materials.MATERIALS)


@pytest.fixture
def listing(tmp_path: Path):
    def write(rows: str, header: str = HEADER) -> Path:
        path = tmp_path / "names.csv"
        path.write_text(header + rows, encoding="utf-8")
        return path

    return write


def test_alternatives_are_right_and_what_cannot_be_told_is_not_judged(listing) -> None:
    rows = read(
        listing("a,Ladder,metal or wood\na,Floor,?\na,Canvas,none\na,Cat,animal (no class)\n")
    )
    answers = list(zip(rows, ("wood", "stone", "fabric", None), (0.7, 0.9, 0.9, 0.0), strict=True))
    scored = score(answers)

    assert (scored.matter.right, scored.matter.n) == (1, 1)
    assert (scored.all.right, scored.all.n) == (1, 2)
    assert (scored.sure.right, scored.sure.n) == (0, 1)
    assert (scored.spoke.right, scored.spoke.n) == (1, 1)


def test_a_belief_below_one_half_counts_as_silence(listing) -> None:
    (row,) = read(listing("a,Ladder,wood\n"))

    assert score([(row, "wood", 0.49)]).spoke.right == 0
    assert score([(row, "wood", 0.51)]).spoke.right == 1


def test_beliefs_are_compared_with_the_share_that_was_right(listing) -> None:
    rows = read(listing("a,Ladder,wood\na,Bench,metal\n"))

    ((count, belief, right),) = bins([(rows[0], "wood", 0.71), (rows[1], "wood", 0.73)])
    assert (count, right) == (2, 0.5)
    assert belief == pytest.approx(0.72)


def test_a_ground_that_was_wrong_is_believed_less_and_one_that_was_right_never_more(
    listing,
) -> None:
    wrong = fit(read(listing("a,OakDesk,metal\n" * 40)), LEXICON)
    right = fit(read(listing("a,OakDesk,wood\n" * 40)), LEXICON)

    assert wrong["stuff"] < 0.1
    assert right["stuff"] == 1.0
    assert wrong["usual"] == right["usual"] == 1.0


def test_each_scene_is_judged_by_what_the_others_taught(listing, capsys) -> None:
    rows = "a,OakDesk,metal\n" * 40 + "b,PineShelf,wood\n"
    assert run(listing(rows), as_json=False) == 0
    told = capsys.readouterr().out

    own, other = told.split("\na\n")[1].split("\nb\n")
    assert "sure   0%" in own  # believed, since b is right
    assert "sure   - (n = 0)" in other  # not believed, since a is wrong


def test_a_file_that_is_no_list_of_names_is_refused_by_column(listing, tmp_path, capsys) -> None:
    assert run(listing("a,Oak\n", "scene,name\n"), as_json=False) == 2
    assert "no column expected" in capsys.readouterr().out
    assert run(tmp_path / "absent.csv", as_json=False) == 2
