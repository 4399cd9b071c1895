"""The report of a study: the paper's figures, closed forms, and files of a study made up here."""

import csv
import json
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy import special, stats

from hapticvlm.commands.main import main
from hapticvlm.devices.faults import SPEAKER_LOW
from hapticvlm_studio.design import design as designs
from hapticvlm_studio.design import paper
from hapticvlm_studio.design.design import Plan
from hapticvlm_studio.design.patterns import paper_like
from hapticvlm_studio.design.stimuli import StudyError
from hapticvlm_studio.report import report, results, statistics, text
from hapticvlm_studio.report.evaluate import evaluate, evaluate_paper
from hapticvlm_studio.trials import record
from hapticvlm_studio.trials.player import SILENT
from hapticvlm_studio.trials.record import Log

PEOPLE = 4


@pytest.fixture
def study(tmp_path: Path) -> Path:
    """Four people who take every third fabric pattern for whooshing, felt on simulated devices."""
    made = designs.design(paper_like(), [f"P{i}" for i in range(PEOPLE)], Plan(repeats=3))
    designs.write_design(tmp_path, made)
    for person, (code, trials) in enumerate(made.trials.items()):
        file = Log(tmp_path, code)
        devices = {"speaker": {"name": "x", "simulated": True}}
        file.add({"event": "opened", "devices": devices})
        for trial, name in enumerate(trials):
            head = {"trial": trial, "pattern": name, "attempt": 1}
            wrong = name.startswith("fabric") and (trial + person) % 3 == 0
            answered = name.replace("fabric-rubbing", "metal-whooshing") if wrong else name
            file.add({"event": "presented", **head})
            said = {"answered": answered, "reaction_s": 1.0 + person, "seen_ms": 900.0}
            file.add({"event": "answered", **head, **said})
            plate = {"onset_plate_c": 32.5, "plate_c": 33.0, "setpoint_c": 34.0, "limited_by": None}
            file.add({"event": "played", **head, **plate})
        file.close()
    return tmp_path


def test_the_papers_printed_figures_are_reproduced() -> None:
    document = evaluate_paper()
    whole = document["recognition"]
    material, warmth = document["axes"]
    printed = [each["as_printed"] for each in document["printed_anova"]]
    assert (whole["right"], whole["of"]) == (381, 450)
    assert whole["wilson"] == pytest.approx((0.810, 0.877), abs=5e-4)
    assert (material["right"], warmth["right"]) == (395, 431)
    assert [round(100 * e["share"], 1) for e in material["each"]] == [100, 88.9, 85.6, 80, 84.4]
    assert [round(100 * each["share"], 1) for each in warmth["each"]] == [97.3, 94.2]
    assert document["information"]["bits"] == pytest.approx(2.53, abs=5e-3)
    assert document["information"]["bias"] == pytest.approx(0.13, abs=5e-3)
    assert [e["p"] for e in printed] == pytest.approx([0.0625, 0.146, 0.410], abs=5e-4)
    assert [e["partial_eta2"] for e in printed] == pytest.approx([0.193, 0.244, 0.116], abs=1e-3)


def test_the_papers_inconsistencies_are_shown_in_figures() -> None:
    document = evaluate_paper()
    two_way = [each["two_way_df"]["p"] for each in document["printed_anova"]]
    first = document["pairwise"][0]
    assert two_way == pytest.approx([0.13, 0.146, 0.40], abs=5e-3)
    assert (first["first"], first["second"]) == ("WC-h", "FR-c")
    assert first["p_holm"] < 0.05
    assert document["anova"] == []
    assert "unpublished" in document["anova_missing"]


def test_shares_have_wilsons_interval() -> None:
    found = statistics.share(45, 45)
    assert found.wilson is not None
    z2 = 1.959964**2
    assert found.wilson == pytest.approx((45 / (45 + z2), 1.0))
    assert statistics.share(0, 0).share is None


def test_the_interval_by_person_is_wider_where_people_differ() -> None:
    alike = statistics.share_by_person([25, 25, 25, 25], [50] * 4)
    apart = statistics.share_by_person([50, 50, 0, 0], [50] * 4)
    assert alike.by_person is not None
    assert apart.by_person is not None
    assert alike.by_person[0] > apart.by_person[0] + 0.2
    assert alike.wilson == apart.wilson
    assert 0.0 < apart.by_person[0] < 0.5 < apart.by_person[1] < 1.0
    assert statistics.share_by_person([25], [50]).by_person is None
    right = statistics.share_by_person([5] * 9, [5] * 9)
    assert right.by_person is not None
    assert 0.7 < right.by_person[0] < 1.0


def coverage(spread: float, trials: int, studies: int = 1500) -> tuple[float, float]:
    """Share of studies of nine people whose intervals hold the truth: by person, and Wilson."""
    rng = np.random.default_rng(8)
    truth = float((1.0 / (1.0 + np.exp(-2.0 - spread * rng.normal(size=200_000)))).mean())
    held = [0, 0]
    for _ in range(studies):
        share = 1.0 / (1.0 + np.exp(-2.0 - spread * rng.normal(size=9)))
        found = statistics.share_by_person(rng.binomial(trials, share).tolist(), [trials] * 9)
        for at, interval in enumerate((found.by_person, found.wilson)):
            assert interval is not None
            held[at] += interval[0] <= truth <= interval[1]
    return held[0] / studies, held[1] / studies


@pytest.mark.parametrize("trials", [5, 50])
@pytest.mark.parametrize("spread", [0.3, 0.8])
def test_the_interval_by_person_covers_95_percent_with_nine_people(
    spread: float, trials: int
) -> None:
    by_person, wilson = coverage(spread, trials)
    print(f"spread {spread:g} logits, {trials} trials: {by_person:.1%}, Wilson {wilson:.1%}")
    assert by_person >= 0.935
    assert wilson <= by_person


def test_perfect_answers_carry_all_bits_and_guesses_none() -> None:
    assert statistics.information_bits(5 * np.eye(8, dtype=np.int64))[0] == pytest.approx(3.0)
    assert statistics.information_bits(np.full((8, 8), 5))[0] == pytest.approx(0.0, abs=1e-12)
    assert statistics.information_bits(np.zeros((8, 8), dtype=np.int64)) == (0.0, 0.0)


def test_collapsing_keeps_every_trial_and_adds_up_its_group() -> None:
    names, found = statistics.collapsed(paper.confusion(), list(paper.VIBRATIONS) * 2)
    assert names == list(paper.VIBRATIONS)
    assert found.sum() == 450
    assert np.diag(found).tolist() == [90, 80, 77, 72, 76]


def test_an_effect_of_two_levels_is_the_square_of_a_paired_t() -> None:
    rates = np.random.default_rng(3).uniform(size=(7, 5, 2))
    difference = (rates[:, :, 0] - rates[:, :, 1]).mean(axis=1)
    t = difference.mean() / (difference.std(ddof=1) / np.sqrt(7))
    assert statistics.anova(rates)[1].f == pytest.approx(t**2)


def test_the_anova_finds_what_was_put_in() -> None:
    rates = 0.7 + np.random.default_rng(4).normal(0.0, 0.05, size=(9, 5, 2))
    rates[:, 1, :] -= 0.3
    vibration, temperature, both = statistics.anova(rates)
    assert vibration.p is not None
    assert vibration.p < 1e-6
    assert min(temperature.p or 0.0, both.p or 0.0) > 0.01


def test_epsilon_and_the_corrected_p_are_those_of_box() -> None:
    rates = np.random.default_rng(7).uniform(size=(6, 4, 2)) ** 3
    scores = (rates.mean(axis=2), rates.mean(axis=1), rates[:, :, 0] - rates[:, :, 1])
    for found, levels in zip(statistics.anova(rates), scores, strict=True):
        covariance, k = np.cov(levels, rowvar=False), levels.shape[1]
        centred = covariance - covariance.mean(axis=0) - covariance.mean(axis=1)[:, None]
        centred += covariance.mean()
        epsilon = np.trace(centred) ** 2 / ((k - 1) * (centred**2).sum())
        p = stats.f.sf(found.f, epsilon * found.df, epsilon * found.df_error)
        assert (found.epsilon, found.p_corrected) == pytest.approx((epsilon, p))


def test_people_who_never_err_leave_f_undefined() -> None:
    assert [each.f for each in statistics.anova(np.ones((3, 5, 2)))] == [None] * 3
    pairs = statistics.pairwise_by_person(np.ones((3, 4)), "abcd")
    assert {pair.p_holm for pair in pairs} == {1.0}


def test_pairs_are_tested_by_t_within_people_and_by_sign_where_all_differ_alike() -> None:
    rates = np.random.default_rng(9).uniform(size=(5, 2))
    (pair,) = statistics.pairwise_by_person(rates, "ab")
    assert pair.p == pytest.approx(stats.ttest_rel(*rates.T).pvalue)
    assert pair.difference == pytest.approx(rates[:, 0].mean() - rates[:, 1].mean())
    (alike,) = statistics.pairwise_by_person(np.tile([0.9, 0.4], (5, 1)), "ab")
    assert (alike.difference, alike.p) == pytest.approx((0.5, 2 * 0.5**5))


def test_intervals_by_person_are_students_on_the_mean_and_on_the_logit_of_the_share() -> None:
    means = [2.0, 3.5, 4.0, 6.5]
    expected = stats.t.interval(0.95, 3, 4.0, stats.sem(means))
    mean, interval = statistics.mean_by_person(means)
    assert mean == 4.0
    assert interval == pytest.approx(expected)
    assert statistics.mean_by_person([2.0]) == (2.0, None)
    right, of = np.array([9, 4, 7, 2]), np.array([10, 10, 8, 10])
    for each, variance in (  # equation (1); and of people alike, that of independent trials
        (right, 4 / 3 * ((right - 22 / 38 * of) ** 2).sum() / 38**2),
        (of // 2, 19.5 / 39 * (1.0 - 19.5 / 39) / 38),
    ):
        middle = (each.sum() + 0.5) / 39
        half = stats.t.ppf(0.975, 3) * np.sqrt(variance) / (middle * (1.0 - middle))
        ends = special.expit(special.logit(middle) + half * np.array([-1.0, 1.0]))
        found = statistics.share_by_person(each.tolist(), of.tolist())
        assert found.by_person == pytest.approx(tuple(ends))


def test_holms_correction_is_that_of_statsmodels() -> None:
    from statsmodels.stats.multitest import multipletests

    right = np.random.default_rng(6).integers(20, 46, size=10).tolist()
    pairs = statistics.pairwise_pooled(right, [45] * 10, "abcdefghij")
    expected = multipletests([pair.p for pair in pairs], method="holm")[1]
    assert [pair.p_holm for pair in pairs] == pytest.approx(expected)


def test_the_papers_report_needs_no_package_beyond_what_is_installed(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("scipy", "statsmodels", "statsmodels.stats.anova", "pandas"):
        monkeypatch.setitem(sys.modules, name, None)
    assert main(["study", "report", "--paper"]) == 0
    assert "381/450" in capsys.readouterr().out


def test_the_report_counts_what_was_answered(study: Path) -> None:
    document = evaluate(results.read(study))
    wrong = sum(
        event["event"] == "answered" and event["pattern"] != event["answered"]
        for code in ("P0", "P1", "P2", "P3")
        for event in record.events(study, code)
    )
    assert wrong > 3
    assert document["recognition"]["right"] == 120 - wrong
    assert np.array(document["counts"]).sum() == 120
    assert document["axes"][1]["share"] == 1.0
    assert document["axes"][0]["right"] == 120 - wrong
    assert document["simulated"]
    assert [found["name"] for found in document["friedman"]] == ["patterns", "vibration"]
    assert "F(4, 12)" in text.text_of(document)
    assert [(e["df"], e["df_error"]) for e in document["anova"]] == [(4, 12), (1, 3), (4, 12)]


def test_a_presentation_whose_speaker_played_nothing_is_counted(study: Path) -> None:
    file = Log(study, "P1")
    trial = {"trial": 29, "pattern": "any", "attempt": 1}
    file.add({"event": "spoiled", **trial, "why": SILENT})
    file.add({"event": "spoiled", **trial, "trial": 30, "why": f"{SPEAKER_LOW.text}; hot"})
    file.close()
    document = evaluate(results.read(study))
    assert (document["answered"], document["excluded"], document["silent"]) == (120, 1, 2)
    assert "speaker played nothing in 2 presentations" in text.text_of(document)


def test_a_trial_that_the_devices_spoiled_is_left_out_and_counted(study: Path) -> None:
    file = Log(study, "P3")
    trial = {"trial": 29, "pattern": "any", "attempt": 1}
    file.add({"event": "spoiled", **trial, "why": "device at fault: sensor_open"})
    file.add({"event": "spoiled", **trial, "trial": 28, "why": "interrupted"})
    file.close()
    document = evaluate(results.read(study))
    assert (document["answered"], document["excluded"]) == (120, 1)
    assert np.array(document["counts"]).sum() == 119


def test_one_dropout_leaves_the_tests_of_all_others_and_is_named(study: Path) -> None:
    path = study / "P2.jsonl"
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join(lines[: 1 + 3 * 8]))
    document = evaluate(results.read(study))
    assert document["anova_missing"] is None
    assert (document["complete"], document["incomplete"]) == (3, ["P2"])
    assert [(e["df"], e["df_error"]) for e in document["anova"]] == [(4, 8), (1, 2), (4, 8)]
    assert document["pairwise_test"].startswith("paired t")
    assert document["recognition"]["of"] == 98
    assert "3 participants who felt every pattern; without P2" in text.text_of(document)


def test_friedman_finds_a_pattern_that_all_feel_worse_and_says_nothing_of_equals() -> None:
    rates = 0.8 + np.random.default_rng(5).normal(0.0, 0.02, size=(9, 10))
    rates[:, 4] -= 0.5
    rates[:, 5] = rates[:, 6]
    found = statistics.friedman(rates, "patterns")
    assert found is not None
    assert (found.chi2, found.p) == pytest.approx(stats.friedmanchisquare(*rates.T))
    assert found.df == 9
    assert found.chi2 == pytest.approx(9 * 9 * found.w)
    assert found.p < 0.05
    assert statistics.friedman(np.ones((9, 10)), "patterns") is None
    assert statistics.friedman(rates[:, :2], "temperature") is None


def test_one_person_gets_no_anova_and_the_reason(study: Path) -> None:
    for code in ("P1", "P2", "P3"):
        (study / f"{code}.jsonl").unlink()
    document = evaluate(results.read(study))
    assert document["anova"] == []
    assert "two participants" in document["anova_missing"]
    assert "No repeated-measures ANOVA" in text.text_of(document)


def test_a_table_for_excel_has_semicolons_and_decimal_commas(study: Path, tmp_path: Path) -> None:
    path = tmp_path / "trials.csv"
    results.write_csv(path, results.read(study), decimal_comma=True)
    with path.open(newline="", encoding="utf-8-sig") as file:
        rows = list(csv.DictReader(file, delimiter=";"))

    assert len(rows) == 120
    assert rows[0]["reaction_s"] == "1,0"
    assert rows[0]["trial"] == "0"


def test_json_is_one_document(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["study", "report", "--paper", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert (document["answered"], document["silent"]) == (450, None)


def test_a_study_without_answers_says_so(tmp_path: Path) -> None:
    designs.write_design(tmp_path, designs.design(paper_like(), ["P1"], Plan()))
    with pytest.raises(StudyError, match="no trial is answered"):
        report.report(tmp_path, None, as_json=False)


def test_without_statsmodels_all_but_the_anova_is_reported_and_the_package_named(
    study: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "statsmodels.stats.anova", None)
    assert main(["study", "report", str(study)]) == 0
    printed = capsys.readouterr().out
    assert "No repeated-measures ANOVA: it needs statsmodels: `" in printed
    assert "install statsmodels`" in printed
    assert "Friedman's test" in printed
    assert (study / "report" / "report.html").exists()


def test_without_matplotlib_there_is_a_report_that_says_what_it_lacks(study, monkeypatch):
    out = study / "report"
    out.mkdir()
    (out / "recognition.png").write_bytes(b"of an earlier evaluation")
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    assert main(["study", "report", str(study)]) == 0
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "they need matplotlib" in page
    assert page.count("<img") == page.count("data:image/svg+xml") == 1
    assert (out / "trials.csv").exists()
    assert not list(out.glob("*.png"))
