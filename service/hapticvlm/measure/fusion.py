"""What fusing the looks at an object is worth, on captures that say what each object truly is.

Every frame that shows an object is looked at as the service does, by its mask and where the picture
has changed; all ways of fusing see the same looks, and hysteresis follows each. Beside being right
and standing still, a decision must follow when something else is shown: for that the last looks at
one object are followed by the first at another. By pictures alone: no name, no shader.
"""

from __future__ import annotations

import itertools
import json
import platform
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from hapticvlm import __version__, materials
from hapticvlm.measure.streams import Stream, read_streams
from hapticvlm.measure.ways import Way, ways
from hapticvlm.recognition.encoder import load_encoder
from hapticvlm.recognition.gallery import Gallery, load_gallery
from hapticvlm.recognition.ladder import Evidence, Verdict, decide, prefer

PER = 300  # frames, of a flip rate
SWITCH = 20  # looks before and after something else is shown
SWITCHES = 200
SEED = 7
COLUMNS = {  # of the table; the JSON line has all figures
    "right": "right",
    "wrong": "wrong",
    "guess_right": "guess right",
    "right_at_end": "right at end",
    "flips_per_300": "flips per 300",
    "swaps_per_300": "swaps per 300",
    "returns_per_300": "returns per 300",
    "frames_until_right": "frames until right",
    "never_right": "never right",
    "looks_until_old_gone": "looks until gone",
    "looks_until_new_said": "until new said",
    "surprise_nats": "nats",
    "us_per_look": "us a look",
}

Labels = NDArray[np.object_]


@dataclass(frozen=True, slots=True, eq=False)
class Felt:
    """Per frame of a stream: what is felt, the best guess, and the surprise at the truth, nats."""

    truth: Labels
    said: Labels
    guess: Labels
    surprise: NDArray[np.float64]

    @property
    def flips(self) -> list[tuple[str, str]]:
        """What was felt before and after each change."""
        return [pair for pair in itertools.pairwise(self.said) if pair[0] != pair[1]]

    @property
    def returns(self) -> int:
        """How often a label was taken up again that had been left: flicker, no correction."""
        return len(self.flips) + 1 - len(set(self.said))


def run(
    folders: Sequence[Path], encoder_name: str | None, gallery_path: Path | None, *, as_json: bool
) -> int:
    """Print a table (unless `as_json`) and a last line of JSON; 2 when the captures show nothing.

    Raises EncoderError, GalleryError, CaptureError.
    """
    encoder = load_encoder(encoder_name)
    gallery = load_gallery(gallery_path, encoder=encoder)
    streams = [one for folder in folders for one in read_streams(folder, encoder, gallery)]
    if not streams:
        print("no frame of these captures says what it shows (`object_id` and `truth`)")
        return 2
    rows = [{"way": name} | figures(way, streams, gallery) for name, way in ways().items()]
    result = {
        "measure": "fusion",
        "hapticvlm": __version__,
        "python": platform.python_version(),
        "numpy": np.__version__,
        "machine": platform.machine(),
        "encoder": encoder.name,
        "captures": [folder.name for folder in folders],
        "objects": len(streams),
        "frames": sum(len(one.truth) for one in streams),
        "looks": sum(int(one.is_new.sum()) for one in streams),
        "rows": rows,
    }
    if not as_json:
        _print_table(result, rows)
    print(json.dumps(result))
    return 0


def figures(way: Way, streams: Sequence[Stream], gallery: Gallery) -> dict[str, object]:
    """Figures of one way to fuse; shares 0..1 of frames or, at the end, of objects.

    A flip is any change of what is felt; a swap is one from material to material, a return one to
    what was felt before.
    """
    started = time.perf_counter()
    felt = [feel(way, stream, gallery) for stream in streams]
    looks = sum(int(stream.is_new.sum()) for stream in streams)
    took_us = (time.perf_counter() - started) / looks * 1e6
    flips = [pair for one in felt for pair in one.flips]
    swaps = [pair for pair in flips if materials.UNKNOWN not in pair]
    rate = PER / max(1, sum(len(one.said) - 1 for one in felt))
    until_right = [first(one.said == one.truth) for one in felt]
    return {
        "right": _share(one.said == one.truth for one in felt),
        "wrong": _share((one.said != one.truth) & (one.said != materials.UNKNOWN) for one in felt),
        "guess_right": _share(one.guess == one.truth for one in felt),
        "right_at_end": _share((one.said == one.truth)[-1:] for one in felt),
        "guess_right_at_end": _share((one.guess == one.truth)[-1:] for one in felt),
        "flips_per_300": round(rate * len(flips), 2),
        "swaps_per_300": round(rate * len(swaps), 2),
        "returns_per_300": round(rate * sum(one.returns for one in felt), 2),
        "frames_until_right": _median(until_right),
        "never_right": until_right.count(None),
        **switches(way, streams, gallery),
        "surprise_nats": round(float(np.concatenate([o.surprise for o in felt]).mean()), 3),
        "us_per_look": round(took_us, 1),
    }


def switches(way: Way, streams: Sequence[Stream], gallery: Gallery) -> dict[str, object]:
    """Median looks until the old label is gone, and until the one the new object gets is said.

    Of random pairs of objects with SWITCH looks each, those that get two different labels.
    """
    taken = [stream.part(stream.is_new) for stream in streams]
    long = [stream for stream in taken if len(stream.truth) >= SWITCH // 2]
    rng = np.random.default_rng(SEED)
    gone: list[int | None] = []
    arrived: list[int | None] = []
    for _ in range(SWITCHES if long else 0):
        one, other = (long[number] for number in rng.integers(len(long), size=2))
        one, other = one.part(slice(-SWITCH, None)), other.part(slice(SWITCH))
        said = feel(way, one.then(other), gallery).said
        old, new = said[len(one.truth) - 1], feel(way, other, gallery).said[-1]
        if materials.UNKNOWN not in (old, new) and old != new:
            after = said[len(one.truth) :]
            gone.append(first(after != old) or SWITCH + 1)
            arrived.append(first(after == new) or SWITCH + 1)
    return {
        "looks_until_old_gone": _median(gone),
        "looks_until_new_said": _median(arrived),
        "switches": len(gone),
    }


def feel(way: Way, stream: Stream, gallery: Gallery) -> Felt:
    """Fuse, decide and hold the label as the service does; between looks it stays."""
    fused = way(stream.part(stream.is_new), gallery)
    verdict: Verdict | None = None
    said: list[str] = []
    for evidence in fused:
        verdict = prefer(verdict, decide([evidence]))
        said.append(verdict.material)
    looks = np.cumsum(stream.is_new) - 1
    guess = [evidence.material or materials.UNKNOWN for evidence in fused]
    surprise = [
        _surprise(fused[look], truth) for look, truth in zip(looks, stream.truth, strict=True)
    ]
    return Felt(
        stream.truth,
        np.array(said, np.object_)[looks],
        np.array(guess, np.object_)[looks],
        np.array(surprise),
    )


def first(hits: NDArray[np.bool_]) -> int | None:
    """Count up to the first hit, from 1; None without any."""
    return int(hits.argmax()) + 1 if hits.any() else None


def _surprise(evidence: Evidence, truth: str) -> float:
    """Surprise at the truth, what is open spread over all classes and unknown."""
    beliefs = dict(evidence.beliefs)
    rest = max(0.0, 1.0 - sum(beliefs.values()))
    likely = rest if truth == materials.UNKNOWN else beliefs.get(truth, 0.0)
    return -float(np.log(min(1.0, likely + rest / (len(materials.MATERIALS) + 1) + 1e-6)))


def _share(hits: Iterable[NDArray[np.bool_]]) -> float:
    return round(float(np.concatenate(list(hits)).mean()), 3)


def _median(counts: Sequence[int | None]) -> float | None:
    found = [count for count in counts if count is not None]
    return float(np.median(found)) if found else None


def _print_table(result: dict[str, object], rows: Sequence[dict[str, object]]) -> None:
    title = f"{result['encoder']}: {result['objects']} objects, {result['looks']} looks"
    table = Table(title=f"{title} at {result['frames']} frames", box=None)
    table.add_column("way", no_wrap=True)
    for heading in COLUMNS.values():
        table.add_column(heading, justify="right")
    for one in rows:
        cells = ("-" if one[key] is None else str(one[key]) for key in COLUMNS)
        table.add_row(str(one["way"]), *cells)
    Console(width=140).print(table)
