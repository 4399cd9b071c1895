"""The ambient chart: real costs, and no error where answers mean nothing."""

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from serving import endpoint, says, sends

from hapticvlm.vlm.contract import VlmError, VlmSettings
from hapticvlm.vlm.local import load_local
from hapticvlm_lab.bench.ambient import chart_plot, methods
from hapticvlm_lab.bench.ambient.chart import RANDOM, Plan, run
from hapticvlm_lab.bench.ambient.rows import Row
from hapticvlm_lab.bench.ambient.timing import Timed, measure
from hapticvlm_studio.evaluation.scores import Guess, score

PICTURES = [np.full((120, 160, 3), shade, np.uint8) for shade in (0, 120, 240)]
TRUTHS = (2.0, 14.0, 31.0)


def timed(seconds: float, guesses: tuple[Guess | None, ...] = ()) -> Timed:
    return Timed(3, seconds, 2 * seconds, 1.0, 500.0, guesses)


def test_the_wire_alone_is_timed_in_a_process_of_its_own() -> None:
    found = measure(methods.wire(), PICTURES)
    assert isinstance(found, Timed)
    assert found.n == 3
    assert 0.0 < found.median_s <= found.longest_s
    assert found.guesses == (Guess(21.0, 13.0, 29.0),) * 3
    assert found.peak_mb is None or 20.0 < found.peak_mb < 2000.0


def test_an_endpoint_that_does_not_answer_is_left_out_and_said_to_be() -> None:
    with endpoint(sends("", "500 Internal Server Error")) as served:
        found = measure(methods.remote(served.url, "some/vlm", None), PICTURES)
    assert isinstance(found, str)
    assert "HTTP 500" in found


def test_the_ways_differ_in_one_thing_each_from_the_default() -> None:
    asked = methods.in_process("some/vlm", "cpu")
    default = next(way for way in asked if way.is_default)
    assert (default.settings.image_tokens, default.precision) == (256, "bfloat16")
    assert {way.family for way in asked} == {"readout", "generation"}
    assert sorted(way.settings.image_tokens for way in asked) == [64, 128, 256, 256, 256]
    assert sum(way.is_default for way in asked) == 1
    assert len({way.name for way in asked}) == len(asked)


def test_a_chart_is_drawn_with_and_without_errors(tmp_path: Path) -> None:
    graded = score([Guess(20.0, 12.0, 28.0)] * 3, TRUTHS)
    rows = [
        Row("constant: default", "constant", False, None, graded, None),
        Row("remote", "remote", False, timed(0.2), graded, None),
        Row("readout, 64 tokens, bf16", "readout", True, timed(2.0), None, None),
        Row("readout, 64 tokens, fp32", "readout", False, None, None, "too little memory"),
    ]
    for name, some in (("all", rows), ("bare", rows[2:])):
        paths = chart_plot.draw(some, RANDOM, tmp_path / name)
        assert [path.suffix for path in paths] == [".png", ".svg"]
        assert "random weights" in paths[1].read_text(encoding="utf-8")
        with Image.open(paths[0]) as picture:
            assert picture.width == 1200


@pytest.mark.torch
def test_the_charts_generation_reads_what_the_library_writes(tmp_path: Path) -> None:
    pytest.importorskip("transformers", reason="the extra `models` brings transformers")
    from tiny_llava import write_llava

    from hapticvlm_lab.bench.ambient.writing import WritingVlm

    def writer(name: str, answer: str) -> WritingVlm:
        folder = write_llava(tmp_path / name, answer)
        return WritingVlm(load_local(VlmSettings(model=str(folder)), "float32"))

    reading = writer("number", "21").ambient(PICTURES[1])
    assert (reading.value_c, reading.low_c, reading.high_c) == (21.0, 13.0, 29.0)
    assert (reading.method, reading.prompt_sd_c, reading.share) == ("text", None, None)
    with pytest.raises(VlmError, match="states no temperature: `warm`"):
        writer("words", "warm").ambient(PICTURES[1])


@pytest.mark.slow
def test_a_random_model_is_timed_and_never_graded(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("transformers", reason="the extra `models` brings transformers")
    lines = ["image,temperature_c"]
    for at, (pixels, truth) in enumerate(zip(PICTURES, TRUTHS, strict=True)):
        Image.fromarray(pixels).save(tmp_path / f"{at}.png")
        lines.append(f"{at}.png,{truth}")
    (tmp_path / "truth.csv").write_text("\n".join(lines), encoding="utf-8")
    with endpoint(says("20")) as served:
        plan = Plan(
            data=tmp_path / "truth.csv",
            model=None,
            size="tiny",
            device="cpu",
            url=served.url,
            token=None,
            out=tmp_path,
            as_json=True,
            budgets=(64,),
        )
        assert run(plan) == 0
    figures = json.loads(capsys.readouterr().out.splitlines()[-1])
    rows = {row["name"]: row for row in figures["rows"]}
    assert figures["weights"] == "random"
    assert RANDOM in figures["model"]
    for method in methods.in_process("any", "cpu", budgets=(64,)):
        assert rows[method.name]["timed"]["median_s"] > 0, rows[method.name]["why_not"]
        assert rows[method.name]["score"] is None
    assert rows["remote"]["score"]["mae_c"] == pytest.approx(
        np.mean([abs(20.0 - truth) for truth in TRUTHS])
    )
    assert rows["remote: the wire alone"]["score"] is None
    assert rows["constant: default"]["score"]["n"] == 3
    assert all(Path(path).is_file() for path in figures["files"])
