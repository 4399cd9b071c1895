"""The report that is sent round: whole in one file, with ratings, and with what may be claimed."""

import codecs
import csv
import re
from pathlib import Path
from typing import Any

import pytest

from hapticvlm.commands.main import main
from hapticvlm_studio.design import design as designs
from hapticvlm_studio.design.design import Plan
from hapticvlm_studio.design.form import Form, read
from hapticvlm_studio.design.patterns import paper_like
from hapticvlm_studio.report import claims, report, results
from hapticvlm_studio.report.evaluate import evaluate, evaluate_paper
from hapticvlm_studio.report.text import text_of
from hapticvlm_studio.trials.record import Log

REMARK = "my name is Ann"


def made_up(
    folder: Path,
    people: int,
    repeats: int = 2,
    *,
    simulated: bool = False,
    hear: bool = False,
    remark: str = REMARK,
) -> Path:
    """A study whose people take every fifth fabric pattern for whooshing; nobody felt it."""
    assert main(["study", "new", str(folder)]) == 0
    found = read(folder)
    assert found is not None
    codes = [f"P{number}" for number in range(people)]
    made = designs.design(paper_like(), codes, Plan(repeats=repeats, form=found[0]))
    designs.write_design(folder, made)
    for person, (code, trials) in enumerate(made.trials.items()):
        file = Log(folder, code)
        file.add({"event": "opened", "devices": {"x": {"simulated": simulated}}, "hear": hear})
        file.add({"event": "agreed", "language": "de" if person else "en"})
        answers = {"age": 20 + person, "handedness": "left" if person == 1 else "right"}
        file.add({"event": "told", "when": "begin", "answers": answers})
        for trial, name in enumerate(trials):
            head = {"trial": trial, "pattern": name, "attempt": 1}
            wrong = name.startswith("fabric") and (trial + person) % 5 == 0
            answered = name.replace("fabric-rubbing", "metal-whooshing") if wrong else name
            file.add({"event": "answered", **head, "answered": answered, "reaction_s": 1.0})
            if made.form.is_rated(trial, len(trials), len(made.stimuli)):
                rated = {"real": 4 + person % 2, "pleasant": 3}
                file.add({"event": "rated", **head, "ratings": rated})
        file.add({"event": "told", "when": "end", "answers": {"remarks": remark}})
        file.close()
    return folder


@pytest.fixture(scope="module")
def nine(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = made_up(tmp_path_factory.mktemp("nine"), 9)
    report.report(folder, None, as_json=False)
    return folder


def rows(path: Path) -> list[dict[str, str]]:
    with path.open(newline="", encoding="utf-8-sig") as file:
        return list(csv.DictReader(file))


def test_the_report_is_one_file_that_asks_for_no_other(nine: Path) -> None:
    page = (nine / "report" / "report.html").read_text(encoding="utf-8")
    sources = re.findall(r'(?:src|href)="([^"]*)"', page)
    assert len(sources) == 3
    kinds = [source.partition(";base64,")[0] for source in sources]
    assert kinds == ["data:image/svg+xml", "data:image/png", "data:image/png"]
    assert not re.search(r"https?://|<script|@import|url\(", page)
    assert "default-src 'none'" in page
    assert "<title>Study report: What does it feel like?</title>" in page


def test_the_report_says_n_intervals_by_person_and_what_may_be_claimed(nine: Path) -> None:
    page = (nine / "report" / "report.html").read_text(encoding="utf-8")
    assert "9 participants, 180 of 180 trials answered" in page
    assert "by person" in page
    assert "<h2>What may be claimed</h2>" in page
    assert "<h2>What may not be claimed</h2>" in page
    assert len(re.findall(r'<img[^>]* alt="[^"]+ [^"]+"', page)) == page.count("<img")


def test_free_answers_and_single_ages_stay_out_of_what_is_sent_round(nine: Path) -> None:
    for name in ("report.html", "report.md", "report.json", "trials.csv"):
        assert REMARK not in (nine / "report" / name).read_text(encoding="utf-8")
    text = (nine / "report" / "report.md").read_text(encoding="utf-8")
    assert "age: 9 of 9 answered; mean 24.0, standard deviation 2.7, from 20 to 28" in text
    assert "handedness: 9 of 9 answered; right 8, left 1, both 0" in text


def test_ratings_stand_with_their_trials_and_answers_with_their_people(nine: Path) -> None:
    trials = rows(nine / "report" / "trials.csv")
    rated = [row for row in trials if row["rating_real"]]
    people = rows(nine / "report" / "participants.csv")
    assert len(rated) == 90
    assert {row["rating_pleasant"] for row in rated} == {"3"}
    assert people[1] == {"participant": "P1", "language": "de", "age": "21",
                         "handedness": "left", "remarks": REMARK}  # fmt: skip


@pytest.mark.parametrize("start", ["=", "+", "-", "@", "\t", "\r"])
def test_a_spreadsheet_reads_an_answer_as_text_and_its_letters_as_they_are(
    tmp_path: Path, start: str
) -> None:
    study = results.read(made_up(tmp_path / "study", 1, remark=start + "Jörg"))
    results.write_people(tmp_path / "participants.csv", study)
    assert rows(tmp_path / "participants.csv")[0]["remarks"] == f"'{start}Jörg"
    results.write_csv(tmp_path / "trials.csv", study)
    for name in ("participants.csv", "trials.csv"):
        assert (tmp_path / name).read_bytes().startswith(codecs.BOM_UTF8), name


def test_a_mean_rating_has_an_interval_by_person(nine: Path) -> None:
    real, pleasant = evaluate(results.read(nine))["ratings"]
    # Nine people, four of them at 5 and five at 4: t(8) = 2.306, standard deviation 0.527.
    assert real["mean"] == pytest.approx(4 + 4 / 9)
    assert real["by_person"] == pytest.approx((4.039, 4.850), abs=1e-3)
    assert pleasant["by_person"] == pytest.approx((3.0, 3.0))
    assert all(each["of"] == 9 for each in real["patterns"])


def test_html_in_a_title_is_shown_and_not_obeyed(tmp_path: Path) -> None:
    (tmp_path / "x.png").write_bytes(b"")
    page = report.page("# <script>alert(1)</script>\n\n<b>bold</b> ![x](x.png)", tmp_path)
    assert "<script" not in page
    assert "<b>" not in page


def test_nobody_felt_anything_so_nothing_is_claimed_of_people(tmp_path: Path) -> None:
    for folder, simulated in (("a", True), ("b", False)):
        (tmp_path / folder).mkdir()
        study = made_up(tmp_path / folder, 2, simulated=simulated, hear=not simulated)
        document = evaluate(results.read(study))
        assert (len(document["may"]), len(document["may_not"])) == (1, 1)
        assert not re.search(r"\d|recognise", document["may"][0])


def test_one_person_speaks_for_nobody_else(tmp_path: Path) -> None:
    document = evaluate(results.read(made_up(tmp_path, 1)))
    assert "one person" in document["may"][0]
    assert "one person" in document["may_not"][0]


def test_nine_people_give_an_interval_and_what_they_could_not_have_found(nine: Path) -> None:
    document = evaluate(results.read(nine))
    assert "these 9" in document["may"][0]
    assert "10 %" in document["may"][1]
    alike = next(text for text in document["may_not"] if "alike" in text)
    assert "With 9 people" in alike
    assert "1.1 standard deviations" in alike
    assert not any("that this is the result" in text.lower() for text in document["may_not"])


def test_a_study_that_is_not_finished_is_no_result_yet(tmp_path: Path) -> None:
    folder = made_up(tmp_path, 3)
    (folder / "P2.jsonl").unlink()
    found = evaluate(results.read(folder))["may_not"]
    assert any("40 of 60 trials" in text for text in found)
    assert any("2 people" in text for text in found)


def test_the_papers_people_may_not_be_generalised_from() -> None:
    document = evaluate_paper()
    (claim,) = document["may"]
    assert re.findall(r"\d+", claim) == ["9", "85", "450", "10"]
    assert document["may_not"]


@pytest.mark.parametrize("people", [2, 5, 9, 20, 100])
def test_the_smallest_difference_is_that_of_a_power_table(people: int) -> None:
    from scipy.stats import nct, t

    found_from = t.ppf(0.975, people - 1)
    shift = claims.smallest_difference(people) * people**0.5
    assert nct.sf(found_from, people - 1, shift) == pytest.approx(0.8, abs=1e-4)


def test_bits_of_a_few_trials_are_not_told(tmp_path: Path) -> None:
    few = text_of(evaluate(results.read(made_up(tmp_path, 2, repeats=1))))
    assert "cannot be estimated" in few
    assert "-0." not in re.sub(r"\|.*", "", few)


def test_a_study_without_a_form_needs_no_file_of_people(tmp_path: Path) -> None:
    designs.write_design(tmp_path, designs.design(paper_like(), ["P1"], Plan(repeats=1)))
    file = Log(tmp_path, "P1")
    head = {"trial": 0, "pattern": paper_like()[0].name, "attempt": 1}
    file.add({"event": "answered", **head, "answered": head["pattern"], "reaction_s": 1.0})
    file.close()
    found: Any = results.read(tmp_path)
    assert found.form == Form()
    report.report(tmp_path, None, as_json=False)
    assert not (tmp_path / "report" / "participants.csv").exists()
