"""What the shipped encoder and gallery are worth on sources they never saw, and what they cost.

Accuracy per held-back source (never used for fitting, choosing or calibrating), with what a
majority guess and a colour histogram make of the same pictures; rejection of pictures that show
none of the materials; enrolment of five references per material of the source itself; latency of
crop, embed and match on one thread against decoding the JPEG alone in the same run.
"""

from __future__ import annotations

import csv
import json
import platform
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hapticvlm import materials, messages
from hapticvlm.measure.names import SIBLING, wilson
from hapticvlm.recognition.encoder import Encoder, load_encoder
from hapticvlm.recognition.gallery import Gallery, load_gallery
from hapticvlm.recognition.ladder import KNOWN, SURE
from hapticvlm.recognition.pictures import Crop, crop

HELD_BACK = ("caltech101", "pb_renders")
OPEN_SET = ("unlabelled_caltech101", 400)  # folder, pictures
FOUR = ("wood", "glass", "fabric", "metal")
PALETTE = 60  # pictures a class and source behind the colour-histogram baseline
ENROLLED = 5  # references per material, taken from the source itself
DRAWS = 20
TIMED = 200
_SAME = {"brick": "stone", "concrete": "stone"}
# Folders of the open set: nothing in them is made of a material of the table.
_LIVING = frozenset(
    """Faces Faces_easy Leopards ant beaver brain cougar_body cougar_face crab crayfish crocodile
    crocodile_head dalmatian dolphin dragonfly elephant emu flamingo hedgehog ibis kangaroo llama
    lobster mayfly okapi octopus panda pigeon pizza platypus rhino rooster scorpion sea_horse
    starfish strawberry tick wild_cat""".split()  # noqa: SIM905
)

Floats = NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class Looked:
    """The crops of one source: (N, D) embeddings, (N, H) colour histograms, their materials."""

    embeddings: Floats
    colours: Floats
    truth: NDArray[np.str_]


def run(data: Path | None, as_json: bool) -> int:
    """Print tables (unless `as_json`) and a last line of JSON; 2 when there is no data."""
    folder = data or SIBLING
    if not (folder / "labels.csv").is_file():
        print(f"no labels.csv in {folder}: pass --data with a folder of labelled pictures")
        return 2
    encoder = load_encoder()
    gallery = load_gallery(encoder=encoder)
    sources = {name: look(*_labelled(folder, name), encoder) for name in HELD_BACK}
    palette = _palette(folder, encoder.side)
    rows = [
        _figures(name, seen, gallery) | _forced(seen, gallery, palette)
        for name, seen in sources.items()
    ]
    rejection = _open_figures(folder, encoder, gallery)
    costs = latencies(encoder, gallery)
    versions = {"python": platform.python_version(), "numpy": np.__version__}
    named = {"measure": "encoder", "encoder": encoder.name, "machine": platform.machine()}
    figures = named | versions | {"sources": rows, "open_set": rejection, "latency_ms": costs}
    if not as_json:
        _print_tables(rows, {"open set": rejection, **costs})
    print(json.dumps(figures))
    return 0


def look(paths: Sequence[Path], truth: Sequence[str], encoder: Encoder) -> Looked:
    """Embed the centre of every picture, as the service does with a frame without region."""
    seen = [crop(frame_of(path.read_bytes()), encoder.side) for path in paths]
    return Looked(encoder.embed(seen), np.stack([_histogram(one) for one in seen]), np.array(truth))


def frame_of(jpeg: bytes) -> messages.Frame:
    """Wrap a JPEG file as a frame message."""
    import simplejpeg

    height, width, _, _ = simplejpeg.decode_jpeg_header(jpeg)
    return messages.Frame(
        id=1, captured_at=0.0, format="jpeg", width=width, height=height, image=jpeg, origin="top"
    )


def latencies(encoder: Encoder, gallery: Gallery) -> dict[str, dict[str, float]]:
    """Median and 99th percentile of each stage over one 448 px JPEG frame, ms."""
    import simplejpeg

    rng = np.random.default_rng(5)
    grain = np.kron(rng.uniform(60, 200, (56, 56, 3)), np.ones((8, 8, 1))).astype(np.uint8)
    data = simplejpeg.encode_jpeg(grain, quality=60)
    frame = frame_of(data)
    cut = crop(frame, encoder.side)
    embedding = encoder.embed([cut])[0]
    stages: dict[str, Callable[[], object]] = {
        "floor: decode alone": lambda: simplejpeg.decode_jpeg(data, "RGB"),
        "crop": lambda: crop(frame, encoder.side),
        "embed": lambda: encoder.embed([cut]),
        "match": lambda: gallery.match(embedding),
        "all": lambda: gallery.match(encoder.embed([crop(frame, encoder.side)])[0]),
    }
    return {name: _timed(stage) for name, stage in stages.items()}


def _labelled(data: Path, source: str) -> tuple[list[Path], list[str]]:
    with (data / "labels.csv").open(newline="", encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["path"].startswith(f"{source}/")]
    names = [_SAME.get(row["class"], row["class"]) for row in rows]
    return [data / row["path"] for row in rows], names


def _figures(name: str, seen: Looked, gallery: Gallery) -> dict[str, object]:
    said = [gallery.match(embedding) for embedding in seen.embeddings]
    guess = np.array([evidence.material for evidence in said])
    confidence = np.array([evidence.confidence for evidence in said])
    right = guess == seen.truth
    known, sure = confidence >= KNOWN, confidence >= SURE
    classes = sorted(set(seen.truth.tolist()))
    counts = Counter(seen.truth.tolist())
    spoke = int(known.sum())
    return {
        "source": name,
        "n": len(right),
        "classes": {
            c: [counts[c], round(float(right[seen.truth == c].mean()), 3)] for c in classes
        },
        "accuracy_forced_interval": [
            round(edge, 3) for edge in wilson(int(right.sum()), len(right))
        ],
        "accuracy_forced": round(float(right.mean()), 3),
        "unknown_rate": round(float(1 - known.mean()), 3),
        "right_where_known": round(float(right[known].mean()), 3) if spoke else None,
        "known_interval": [round(e, 3) for e in wilson(int(right[known].sum()), spoke)],
        "sure_rate": round(float(sure.mean()), 3),
        "mean_confidence": round(float(confidence.mean()), 3),
        "majority": round(max(counts.values()) / len(right), 3),
        "chance_balanced": round(1 / len(gallery.materials), 3),
        "enrolled_5": _enrolled(seen.embeddings, seen.truth),
        "enrolled_5_colours": _enrolled(seen.colours, seen.truth),
    }


def _enrolled(features: Floats, truth: NDArray[np.str_]) -> list[float]:
    """Balanced accuracy and its deviation over draws, nearest of ENROLLED references a class."""
    classes = [c for c in sorted(set(truth.tolist())) if (truth == c).sum() >= 2 * ENROLLED]
    rng, shares = np.random.default_rng(11), []
    for _ in range(DRAWS):
        chosen = [rng.choice(np.flatnonzero(truth == c), ENROLLED, replace=False) for c in classes]
        rest = np.isin(truth, classes)
        rest[np.concatenate(chosen)] = False
        like = features[rest] @ features[np.concatenate(chosen)].T
        guess = np.repeat(classes, ENROLLED)[like.argmax(axis=1)]
        shares.append(np.mean([(guess == c)[truth[rest] == c].mean() for c in classes]))
    return [round(float(np.mean(shares)), 3), round(float(np.std(shares)), 3), len(classes)]


def _palette(data: Path, side: int) -> tuple[Floats, NDArray[np.str_]]:
    """Colour histograms of the sources that are not held back, PALETTE a class and source."""
    with (data / "labels.csv").open(newline="", encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["kind"] in ("photo", "texture_albedo")]
    cells: dict[tuple[str, str], list[Path]] = {}
    for row in rows:
        source, truth = row["path"].split("/")[0], _SAME.get(row["class"], row["class"])
        if source not in HELD_BACK and truth in materials.MATERIALS:
            cells.setdefault((truth, source), []).append(data / row["path"])
    chosen = [(truth, path) for (truth, _), paths in cells.items() for path in paths[:PALETTE]]
    found = [_histogram(crop(frame_of(path.read_bytes()), side)) for _, path in chosen]
    return np.stack(found), np.array([truth for truth, _ in chosen])


def _forced(
    seen: Looked, gallery: Gallery, palette: tuple[Floats, NDArray[np.str_]]
) -> dict[str, float]:
    """Balanced accuracy when an answer is forced, of all materials and of FOUR, beside colours."""
    names = np.array(gallery.materials)
    scores, near = gallery.scores(seen.embeddings), seen.colours @ palette[0].T
    figures = {}
    for title, chosen in (("all", gallery.materials), ("four", FOUR)):
        rows = np.isin(seen.truth, chosen)
        ours = np.where(np.isin(names, chosen), scores, -np.inf).argmax(axis=1)
        theirs = np.where(np.isin(palette[1], chosen), near, -np.inf).argmax(axis=1)
        for who, said in (("encoder", names[ours]), ("colour_histogram", palette[1][theirs])):
            right, truth = (said == seen.truth)[rows], seen.truth[rows]
            shares = [right[truth == c].mean() for c in sorted(set(truth.tolist()))]
            figures[f"{who}_{title}"] = round(float(np.mean(shares)), 3)
    return figures


def _open_figures(data: Path, encoder: Encoder, gallery: Gallery) -> dict[str, object]:
    folders = sorted(path for path in (data / OPEN_SET[0]).iterdir() if path.name in _LIVING)
    files = [file for folder in folders for file in sorted(folder.glob("*.jpg"))]
    chosen = files[:: max(1, len(files) // OPEN_SET[1])]
    seen = look(chosen, ["none"] * len(chosen), encoder)
    confidence = np.array([gallery.match(e).confidence for e in seen.embeddings])
    rejected = int((confidence < KNOWN).sum())
    low, high = wilson(rejected, len(chosen))
    return {
        "source": OPEN_SET[0],
        "n": len(chosen),
        "rejected": round(rejected / len(chosen), 3),
        "interval": [round(low, 3), round(high, 3)],
        "mean_confidence": round(float(confidence.mean()), 3),
    }


def _histogram(crop: Crop) -> Floats:
    """Root of the 4 x 4 x 4 colour histogram under the mask: (64,) float32, unit norm."""
    cells = (crop.image[crop.mask > 0] // 64).astype(int) @ np.array((16, 4, 1))
    counts = np.bincount(cells, minlength=64)
    roots: Floats = np.sqrt(counts / counts.sum()).astype(np.float32)
    return roots


def _timed(stage: Callable[[], object]) -> dict[str, float]:
    stage()
    times = []
    for _ in range(TIMED):
        start = time.perf_counter()
        stage()
        times.append((time.perf_counter() - start) * 1e3)
    return {
        "median": round(float(np.median(times)), 3),
        "p99": round(float(np.percentile(times, 99)), 3),
    }


def _print_tables(sources: Sequence[Mapping[str, object]], rest: Mapping[str, object]) -> None:
    for row in sources:
        print(f"\n== {row['source']}, held back")
        print("\n".join(f"{key:>22}: {value}" for key, value in row.items() if key != "source"))
    print("\n== rejection of pictures of none of the materials, and latency on one thread (ms)")
    print("\n".join(f"{key:>22}: {value}" for key, value in rest.items()))
