"""Grading temperatures: beside blind guesses, with intervals, and never a missing one as 0."""

import json
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from each_case import each_row
from in_process import hapticvlm
from PIL import Image
from serving import endpoint, says, sends
from word_tables import words

from hapticvlm.vlm.contract import VlmSettings
from hapticvlm.vlm.remote import RemoteVlm
from hapticvlm_studio.commands.evaluate_ambient import print_outcome
from hapticvlm_studio.evaluation.asking import Answered, by_vlm
from hapticvlm_studio.evaluation.grades import figures, grade
from hapticvlm_studio.evaluation.pictures import (
    LabelledPicture,
    LabelledPictureError,
    read_picture,
    read_pictures,
)
from hapticvlm_studio.evaluation.scores import (
    PAPER,
    Guess,
    bootstrap,
    constant,
    gain,
    score,
    share,
)

pytestmark = pytest.mark.process

TRUTHS = (-5.0, 2.0, 14.0, 20.0, 22.0, 31.0)


@pytest.fixture
def labelled(tmp_path: Path) -> Path:
    """A CSV of six pictures in two folders."""
    lines = ["image,temperature_c"]
    for at, truth in enumerate(TRUTHS):
        name = f"{'out' if truth < 20 else 'in'}/{at}.png"
        (tmp_path / name).parent.mkdir(exist_ok=True)
        Image.new("RGB", (40, 30), (at, 0, 0)).save(tmp_path / name)
        lines.append(f"{name},{truth}")
    return write(tmp_path, lines)


def write(folder: Path, lines: Sequence[str]) -> Path:
    file = folder / "truth.csv"
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return file


def evaluate(*arguments: object) -> tuple[int, dict[str, Any], str, str]:
    """Run the command; return its code, its JSON, all it printed and what it complained."""
    command = [sys.executable, "-m", "hapticvlm", "evaluate", "ambient", *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    figures = json.loads(done.stdout) if done.stdout and "--json" in arguments else {}
    return done.returncode, figures, done.stdout, done.stderr


def guess(value: float, half: float = 4.0) -> Guess:
    return Guess(value, value - half, value + half)


def answered(truths: Sequence[float], said: Sequence[float | None]) -> list[Answered]:
    return [
        Answered(
            LabelledPicture(Path(f"{at}.png"), truth),
            None if v is None else guess(v),
            "down",
            0.1,
        )
        for at, (truth, v) in enumerate(zip(truths, said, strict=True))
    ]


def test_a_score_is_what_its_words_say() -> None:
    found = score([guess(20.0), guess(10.0), guess(0.0)], [22.0, 18.0, 30.0])
    assert found is not None
    assert found.mae_c == pytest.approx((2 + 8 + 30) / 3)
    assert found.bias_c == pytest.approx((-2 - 8 - 30) / 3)
    assert found.within_8c.share == pytest.approx(2 / 3)
    assert found.interval_coverage.share == pytest.approx(1 / 3)
    assert found.interval_width_c == 8.0
    assert found.mae_low_c <= found.mae_c <= found.mae_high_c
    assert score([], []) is None


def test_the_papers_share_has_its_published_interval() -> None:
    paper = share(*PAPER)
    assert paper.share == pytest.approx(0.867, abs=0.001)
    assert (paper.low, paper.high) == pytest.approx((0.595, 0.983), abs=0.001)


def test_the_median_guess_never_sees_the_picture_it_is_graded_on() -> None:
    found = constant("leave-one-out median", [0.0, 10.0, 50.0])
    assert found is not None
    assert [one.value_c for one in found] == [30.0, 25.0, 5.0]
    assert constant("leave-one-out median", [7.0]) is None


def test_the_default_guess_is_the_services_own() -> None:
    found = constant("default", [0.0, 50.0])
    assert found == [Guess(22.0, 18.0, 26.0)] * 2


def test_a_gain_is_paired_so_hard_pictures_cancel() -> None:
    truths = list(np.random.default_rng(0).normal(15, 20, 40))
    ours, theirs = [guess(10.0)] * 40, [guess(10.0) for _ in truths]
    shifted = [guess(t + 5.0) for t in truths]
    better = [guess(t + 4.0) for t in truths]
    assert gain(ours, theirs, truths) == (0.0, 0.0, 0.0)
    assert gain(better, shifted, truths) == pytest.approx((1.0, 1.0, 1.0))


def test_a_bootstrap_interval_is_about_two_standard_errors_wide() -> None:
    values = np.random.default_rng(1).normal(3.0, 2.0, 400)
    low, high = bootstrap(values)
    assert (high - low) / 2 == pytest.approx(1.96 * 2.0 / 20, rel=0.15)


def test_what_was_not_answered_is_graded_nowhere_and_counted() -> None:
    told = figures(grade(answered([10.0, 20.0, 30.0], [12.0, None, 28.0])), "vlm")
    assert (told["asked"], told["n"], told["constant"]["n"]) == (3, 2, 2)
    assert told["mae_c"] == 2.0
    assert told["images"][1]["value_c"] is None
    assert told["images"][1]["why_not"] == "down"


def test_where_nothing_is_answered_no_figure_is_made_up() -> None:
    told = figures(grade(answered([10.0, 20.0], [None, None])), "vlm")
    assert (told["n"], told["mae_c"], told["within_8c"], told["gain_c"]) == (0, None, None, None)
    assert told["constant"]["n"] == 2


@pytest.mark.nightly
def test_the_command_ends_with_one_line_of_figures(labelled: Path) -> None:
    code, figures, printed, complaints = evaluate(labelled, "--json")
    assert (code, complaints) == (0, "")
    assert len(printed.splitlines()) == 1
    assert (figures["n"], figures["asked"], figures["method"]) == (6, 6, "default")
    errors = [abs(22.0 - truth) for truth in TRUTHS]
    assert figures["mae_c"] == pytest.approx(np.mean(errors))
    assert figures["within_8c"] == pytest.approx(3 / 6)
    assert figures["interval_coverage"] == pytest.approx(2 / 6)
    assert {"n", "mae_c", "within_8c", "interval_coverage"} <= figures["constant"].keys()
    rules = figures["constants"]
    assert set(rules) == {"default", "leave-one-out median"}
    assert figures["constant"]["mae_c"] == min(one["mae_c"] for one in rules.values())


@pytest.mark.nightly
def test_a_remote_model_is_graded(labelled: Path) -> None:
    with endpoint(says("20")) as served:
        asked = (labelled, "--vlm-url", served.url)
        code, figures, _, _ = evaluate(*asked, "--json")
        printed = evaluate(*asked)[2]
        assert len(served.questions) >= 6
    assert code == 0
    assert figures["method"].startswith("Qwen/Qwen2-VL-2B-Instruct at 127.0.0.1")
    assert figures["mae_c"] == pytest.approx(np.mean([abs(20.0 - truth) for truth in TRUTHS]))
    assert "the paper, on its own pictures" in printed
    assert "87 % [60, 98]" in printed


def test_an_error_is_said_to_be_lower_or_higher_and_a_missing_answer_why(
    capsys: pytest.CaptureFixture[str],
) -> None:
    truths = (20.0, 21.0, 22.0, 23.0)
    for said, side in ((truths, "lower"), ((50.0, 51.0, 52.0, None), "higher")):
        print_outcome(grade(answered(truths, said)), "vlm")
        verdict = capsys.readouterr().out.splitlines()[-2]
        assert f" degC {side} [" in verdict
        assert " -" not in verdict
    assert verdict.endswith("1 of 4 not answered, the last: down")


def test_a_method_that_answers_nothing_ends_with_the_reason(
    capsys: pytest.CaptureFixture[str],
) -> None:
    print_outcome(grade(answered((20.0, 21.0), (None, None))), "vlm")
    ending = "answered nothing; 2 of 2 not answered, the last: down"
    assert capsys.readouterr().out.splitlines()[-1].endswith(ending)


def test_an_endpoint_that_fails_once_is_waited_for(labelled: Path) -> None:
    broken = sends("", "503 Service Unavailable")
    with endpoint([says("9"), says("9"), broken, says("11")]) as served:
        settings = VlmSettings(url=served.url, model="some/vlm")
        ask = by_vlm(RemoteVlm(settings))
        picture = read_picture(read_pictures(labelled)[0])
        assert ask(picture) == Guess(9.0, 1.0, 17.0)
        with pytest.raises(Exception, match="HTTP 503"):
            ask(picture)
        assert ask(picture) == Guess(11.0, 3.0, 19.0)


def test_a_model_a_csv_or_a_picture_that_is_none_is_named(labelled: Path, tmp_path: Path) -> None:
    torn = tmp_path / "torn"
    torn.mkdir()
    (torn / "a.png").write_bytes(b"no picture")
    for asked, named in (
        ((labelled, "--vlm", tmp_path / "no-model"), "no-model"),
        ((tmp_path / "none.csv",), "none.csv"),
        ((write(torn, ["image,temperature_c", "a.png,20"]),), "a.png"),
    ):
        said = hapticvlm("evaluate", "ambient", *map(str, asked))
        assert said.code == 2
        assert said.err.startswith("hapticvlm evaluate ambient: ")
        assert named in said.err


@each_row(("text", "why"), words(Path(__file__).with_name("wrong.csv"), "temperatures"))
def test_a_csv_that_cannot_be_used_names_row_and_column(
    tmp_path: Path, text: str, why: str
) -> None:
    Image.new("RGB", (8, 8)).save(tmp_path / "a.png")
    with pytest.raises(LabelledPictureError) as caught:
        read_pictures(write(tmp_path, [text]))
    assert why in str(caught.value)
