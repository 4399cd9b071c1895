"""The material chart: held out by object, honest intervals, and the same pictures for all."""

import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tiny_capture import OBJECTS, VIEWS, drawn, write_capture
from tiny_encoders import write_classifier

from hapticvlm.evidence.ladder import decide
from hapticvlm.messages import Frame, Shader
from hapticvlm.statistics import wilson
from hapticvlm.vision.galleries.gallery import Calibration, Gallery
from hapticvlm.vision.pictures import Crop, crop
from hapticvlm_lab.bench import figures
from hapticvlm_lab.bench.material import chart
from hapticvlm_lab.bench.material.answers import answer, embed
from hapticvlm_lab.bench.material.chart import Row, undominated, weakness
from hapticvlm_lab.bench.material.data import FOUR, Source, Stated, View, Where, crops, thin
from hapticvlm_lab.bench.material.methods import Method
from hapticvlm_lab.bench.material.reading import load_sources, read_capture
from hapticvlm_lab.bench.material.scores import Score, interval, open_score, score

FIGURES = ("accuracy", "low", "high", "n", "classes", "recall")


@pytest.fixture(scope="module")
def capture(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_capture(tmp_path_factory.mktemp("tiny") / "tiny")


@pytest.fixture(scope="module")
def source(capture: Path) -> Source:
    return read_capture(capture)


class Colours:
    """An encoder that knows colours alone: the share of each of 64 under the mask."""

    name, side, dimension = "colours", 64, 64

    def embed(self, seen: Sequence[Crop]) -> np.ndarray:
        counts = [
            np.bincount((crop.image[crop.mask > 0] // 64) @ (16, 4, 1), minlength=64)
            for crop in seen
        ]
        shares = np.array([count / count.sum() for count in counts])
        embeddings: np.ndarray = np.sqrt(shares).astype(np.float32)
        return embeddings


def known(sharpness: float = 8.0) -> tuple[Colours, Gallery]:
    """An encoder with a gallery of drawings that no source shows."""
    encoder = Colours()
    names = ("wood", "glass", "fabric", "metal", "stone")
    views = [Crop(*drawn(name, 50 + at, 0)) for at, name in enumerate(names)]
    labels = np.arange(len(names), dtype=np.int64)
    calibration = Calibration(sharpness, 8.0, 0.5)
    return encoder, Gallery(encoder.name, names, encoder.embed(views), labels, calibration)


def test_a_capture_is_read_object_by_object_with_what_the_scene_states(source: Source) -> None:
    assert len(source.views) == len(OBJECTS) * VIEWS
    assert dict(zip(source.objects.tolist(), source.truth.tolist(), strict=True)) == {
        key: truth for key, (truth, _) in OBJECTS.items()
    }
    assert source.cut == "mask"
    assert source.stated["w0"].name == "Oak_Board"
    assert not hasattr(source.stated["s0"], "material")


def test_a_view_is_cut_by_mask_or_nothing(source: Source) -> None:
    view = source.views[0]
    assert view.as_cut("mask").mask == view.mask
    blind = view.as_cut("centre")
    assert blind.mask is None
    assert blind.region is None
    assert view.as_cut("whole").region is not None
    found = crops(source, "mask", 64)[0]
    assert np.array_equal(found.image, crop(view.as_cut("mask"), 64).image)


def test_a_missing_set_is_skipped_and_said(capture: Path) -> None:
    found, skipped = load_sources(Where(None, 0, capture))
    assert [source.name for source in found] == ["tiny"]
    assert len(skipped) == 3
    assert all("--data" in text for text in skipped)


def test_thinning_keeps_classes_alike_and_a_larger_limit_only_adds(source: Source) -> None:
    few, more = thin(source, 12, 2), thin(source, 24, 2)
    assert {view.object_id for view in few.views} <= {view.object_id for view in more.views}
    assert len(few.views) == 12
    objects = {view.object_id: view.truth for view in few.views}
    assert set(Counter(objects.values()).values()) == {1}
    assert [v.object_id for v in thin(source, 12, 2).views] == [v.object_id for v in few.views]


def test_the_majority_is_right_in_one_class_of_those_there(source: Source) -> None:
    said = answer(Method("majority", "guess"), source, None)
    four = score(said.four, said.truth, said.objects, FOUR)
    assert four is not None
    assert four.accuracy == pytest.approx(1 / 4)
    two = source.keep(("wood", "metal"))
    said = answer(Method("majority", "guess"), two, None)
    graded = score(said.four, said.truth, said.objects, FOUR)
    assert graded is not None
    assert graded.accuracy == pytest.approx(1 / 2)


def test_a_method_that_guesses_is_at_chance() -> None:
    rng = np.random.default_rng(1)
    truth = np.array([FOUR[at % 4] for at in range(4000)])
    objects = np.array([f"o{at}" for at in range(4000)])
    graded = score(rng.choice(FOUR, 4000), truth, objects, FOUR)
    assert graded is not None
    assert graded.low < 0.25 < graded.high
    assert graded.high - graded.low < 0.04


def test_accuracy_is_balanced_and_recall_says_the_rest() -> None:
    truth = np.array(["wood"] * 9 + ["metal"])
    said = np.array(["wood"] * 9 + [""])
    graded = score(said, truth, np.arange(10).astype(str), FOUR)
    assert graded is not None
    assert graded.accuracy == pytest.approx(0.5)
    assert graded.recall == {"wood": 1.0, "metal": 0.0}
    assert graded.n == 10


def test_an_interval_counts_objects_and_not_pictures() -> None:
    truth, objects = np.array(["wood", "metal"] * 20), np.array([f"o{n % 10}" for n in range(40)])
    right = np.where(np.arange(40) % 4 < 2, truth, "glass")
    graded = score(right, truth, objects, FOUR)
    once = score(right[:10], truth[:10], objects[:10], FOUR)
    assert graded is not None
    assert once is not None
    assert graded.high - graded.low == pytest.approx(
        interval(graded.accuracy, [5, 5])[1] - interval(graded.accuracy, [5, 5])[0]
    )
    assert interval(0.5, [50, 50])[0] > interval(0.5, [5, 5])[0]
    assert interval(0.5, [50, 1])[0] < interval(0.5, [50, 50])[0]
    assert interval(0.7, [10, 10]) == pytest.approx(wilson(14, 20))


def test_what_says_unknown_is_counted_apart_from_what_is_wrong() -> None:
    truth = np.array(["wood", "wood", "metal", "metal", "unknown"])
    graded = open_score(np.array(["wood", "", "wood", "", "wood"]), truth)
    assert graded is not None
    assert (graded.n, graded.coverage, graded.accuracy) == (4, 0.5, 0.5)


def test_one_picture_is_answered_as_the_ladder_answers(source: Source) -> None:
    encoder, gallery = known()
    method = Method("ours", "ours", encoder, gallery)
    embeddings = embed(method, source)
    assert embeddings is not None
    said = answer(method, source, embeddings)
    assert said.spoken is not None
    verdicts = [decide([gallery.match(row)]) for row in embeddings]
    assert [name or "unknown" for name in said.spoken] == [v.material for v in verdicts]
    assert len(set(said.spoken.tolist())) > 1
    assert set(said.four.tolist()) <= set(FOUR)


def test_references_of_nothing_known_are_no_answer_but_take_belief(source: Source) -> None:
    encoder, gallery = known()
    blob = encoder.embed([Crop(*drawn("unknown", 60, 0))])
    gallery = replace(
        gallery,
        materials=(*gallery.materials, "unknown"),
        references=np.concatenate([gallery.references, blob]),
        labels=np.append(gallery.labels, len(gallery.materials)),
    )
    method = Method("ours", "ours", encoder, gallery)
    embeddings = embed(method, source)
    assert embeddings is not None
    said = answer(method, source, embeddings)
    assert said.spoken is not None
    assert "unknown" not in {*said.spoken.tolist(), *said.eleven.tolist()}
    assert set(said.spoken[source.truth == "unknown"].tolist()) == {""}
    verdicts = [decide([gallery.match(row)]).material for row in embeddings]
    assert [name or "unknown" for name in said.spoken] == verdicts


def test_a_name_that_says_nothing_is_silent_and_counts_as_wrong(source: Source) -> None:
    said = answer(Method("name", "stated", rungs=frozenset({"name"})), source, None)
    assert set(said.four[source.truth == "wood"].tolist()) == {"wood"}
    assert set(said.four[source.truth == "glass"].tolist()) == {""}
    graded = score(said.four, said.truth, said.objects, FOUR)
    assert graded is not None
    assert graded.recall["glass"] == 0.0


def test_a_shader_that_tells_nothing_of_four_apart_is_silent(source: Source) -> None:
    matt, bare = Shader(metallic=0.0, roughness=0.5), Shader(metallic=1.0, roughness=0.3)
    told = {"w0": Stated(shader=matt), "m0": Stated(shader=bare)}
    shaded = Source("shaded", source.views, told)
    said = answer(Method("shader", "stated", rungs=frozenset({"shader"})), shaded, None)
    assert set(said.four[said.objects == "w0"].tolist()) == {""}
    assert set(said.four[said.objects == "m0"].tolist()) == {"metal"}


def test_the_ladder_takes_a_sure_name_over_the_picture(source: Source) -> None:
    encoder, gallery = known()
    rungs = frozenset({"name", "shader"})
    ladder = Method("ladder", "ladder", encoder, gallery, rungs=rungs)  # type: ignore[arg-type]
    said = answer(ladder, source, embed(ladder, source))
    assert set(said.four[source.truth == "metal"].tolist()) == {"metal"}


def test_a_method_is_left_out_where_a_source_has_not_what_it_needs(source: Source) -> None:
    frame = Frame(
        id=1, captured_at=0.0, format="rgb8", width=2, height=2, image=bytes(12), origin="top"
    )
    bare = Source("bare", (View(frame, "a", "wood"), View(frame, "b", "metal")))
    assert bare.cut == "whole"
    for method, fits in (
        (Method("ours", "ours"), (True, True)),
        (Method("name", "stated", rungs=frozenset({"name"})), (True, False)),
        (Method("centre", "ours", cut="centre"), (True, True)),
    ):
        assert (method.fits(source), method.fits(bare)) == fits, method.name


def test_the_line_joins_what_no_cheaper_one_equals() -> None:
    cheap = row("cheap", "named", 0.5, 0.2)
    best = replace(row("best", "ours", 0.9, 2.0), is_default=True)
    dear = row("dear", "named", 0.8, 9.0)
    assert undominated([dear, best, cheap]) == [cheap, best]


def test_the_heading_names_what_the_default_finds_least_often() -> None:
    graded = replace(row("ours", "ours", 0.9, 2.0), is_default=True)
    assert graded.four is not None
    weak = replace(graded.four, recall={"wood": 0.9, "glass": 0.4, "metal": 0.7})
    assert weakness([row("other", "named", 0.1, 1.0)]) is None
    assert weakness([replace(graded, four=weak)]) == ("glass", 0.4)


def row(name: str, family: str, accuracy: float, ms: float) -> Row:
    low, high = interval(accuracy, [25, 25, 25, 25])
    counts = dict.fromkeys(FOUR, 25)
    graded = Score(accuracy, low, high, 100, counts, dict.fromkeys(FOUR, accuracy))
    shown = {"source": "s", "method": name, "family": family, "is_default": False, "cut": "mask"}
    return Row(
        **shown,  # type: ignore[arg-type]
        four=graded,
        eleven=None,
        open=None,
        latency_ms=ms,
    )


def test_labels_cover_neither_each_other_nor_a_dot() -> None:
    from matplotlib import pyplot as plt
    from matplotlib.text import Text

    figure, axes = plt.subplots(figsize=(6, 5), dpi=100)
    axes.set_xlim(0, 10)
    axes.set_ylim(0, 100)
    dots = [(2 + 0.3 * at, 50.0 + at % 3) for at in range(9)]
    figure.canvas.draw()
    figures.place(axes, [(x, y, f"method {x:.1f}", "black") for x, y in dots], dots)
    figure.canvas.draw()
    boxes = [Text.get_window_extent(text) for text in axes.texts]
    assert len(boxes) == len(dots)
    for at, box in enumerate(boxes):
        assert not any(box.overlaps(other) for other in boxes[at + 1 :])
        assert not any(box.contains(*axes.transData.transform(dot)) for dot in dots)
    plt.close(figure)


@pytest.mark.nightly
def test_a_capture_is_charted_and_what_is_left_out_is_said(
    capture: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    named = str(write_classifier(tmp_path / "named.onnx"))
    assert chart.run(Where(None, 0, capture), [named], tmp_path, as_json=True) == 0
    figures = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert any(text.startswith("caltech101") for text in figures["skipped"])
    rows = {row["method"]: row for row in figures["rows"]}
    assert {"majority", "name", "named", "ours", "ladder"} <= set(rows)
    assert [row["method"] for row in figures["rows"] if row["is_default"]] == ["ours"]
    assert rows["majority"]["four"]["accuracy"] == pytest.approx(0.25)
    assert rows["named"]["family"] == "named"
    assert rows["named"]["open"]["n"] == rows["ours"]["open"]["n"], "it says unknown, as ours does"
    assert rows["ours"]["latency_ms"] > 0
    graded = [row["four"] for row in rows.values() if row["four"]]
    for one in graded:
        assert all(one[figure] is not None for figure in FIGURES)
        assert one["low"] - 1e-9 <= one["accuracy"] <= one["high"] + 1e-9
        assert set(one["recall"]) == set(one["classes"])
    for file in figures["files"]:
        assert Path(file).stat().st_size > 5000
    assert json.loads((tmp_path / "chart-material.json").read_text()) == figures
