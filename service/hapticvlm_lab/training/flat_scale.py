"""Fits and grades the treatment of flat pictures: `python -m hapticvlm_lab.training.flat_scale`.

A gallery multiplies the logits of flat pictures (vision/flatness.py) by `Calibration.flat`. `fit`
chooses the factor under which the true materials of flat pictures are least surprising, with four
and with all materials admitted, classes equally, and writes it into the gallery's file. Three kinds
of pictures count equally: game kits, which the encoder reads badly, and rooms and web pictures of
sources.CHOICE, some of which are flat too and are read well. None of them may have taught the head,
which would be too sure of them, and no kit that is held back may be among them.

`report` grades an encoder on crops of kits: by itself, with the factor, and beside objects of the
same kit that are named, as in a scene whose other things have telling names. Names are those of the
files; the name of the object itself is withheld. Objects whose names differ only in words such as
colours and sizes are one family, and nothing is taught by its own family.

Both read .npz files as the renderers of kits and rooms write them: big (N, 224, 224, 4) RGB and
mask, label (N,), and for kits path (N,) of the object.
"""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from hapticvlm.evidence import ladder, names
from hapticvlm.evidence.ladder import Evidence
from hapticvlm.materials import MATERIALS, UNKNOWN
from hapticvlm.vision.encoders.encoder import Encoder
from hapticvlm.vision.encoders.loading import load_encoder
from hapticvlm.vision.flatness import is_flat
from hapticvlm.vision.galleries.gallery import Gallery
from hapticvlm.vision.galleries.storage import FILE_NAME, load_gallery, save_gallery
from hapticvlm.vision.pictures import Crop
from hapticvlm.vision.scene_references import SceneReferences
from hapticvlm_lab.training import describing
from hapticvlm_lab.training.making import FOUR

ALL = tuple(MATERIALS)
FACTORS: tuple[float, ...] = tuple(np.geomspace(0.2, 1.5, 30).tolist())
LEAST = 1e-4  # belief that the truth has at least
NAMED = 20  # objects of a kit that are named
SEED = 3
# Words of a file's name that do not make another thing.
_VARIANT = re.compile(
    r"[\d_]+|\b[a-h]\b|\b(large|small|medium|blue|red|green|brown|yellow|white|grey|long|short"
    r"|tall|wide|double|single|open|closed|broken|damaged|empty|full|corner|half)\b"
)

Floats = NDArray[np.float32]
Flags = NDArray[np.bool_]
Words = NDArray[np.str_]
Doubles = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Kits:
    """N crops: embeddings (N, D), whether they are flat, their materials and objects' paths."""

    embeddings: Floats
    flat: Flags
    truth: Words
    paths: Words

    def keep(self, rows: NDArray[np.bool_]) -> Kits:
        """Return only these crops."""
        return Kits(self.embeddings[rows], self.flat[rows], self.truth[rows], self.paths[rows])

    @property
    def kits(self) -> Words:
        """The kit of each crop, (N,)."""
        return np.array([path.split("/")[-2] for path in self.paths])


def main() -> int:
    """Read the command line; fit or report."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--crops", type=Path, required=True, help="folder of KIT.npz files")
    parser.add_argument("--encoder", help="name of a shipped encoder (lite0)")
    parser.add_argument("--fit", type=Path, help="encoder's folder whose gallery gets the factor")
    parser.add_argument("--work", type=Path, help="folder with drawn rooms/, to fit")
    parser.add_argument("--data", type=Path, help="folder with labels.csv, to fit")
    chosen = parser.parse_args()
    encoder = load_encoder(chosen.encoder)
    gallery = load_gallery(encoder=encoder)
    kits = read(chosen.crops, encoder)
    if chosen.fit is not None:
        if chosen.work is None or chosen.data is None:
            parser.error("--fit needs --work and --data")
        factor = fit([kits, *judging(chosen.data, chosen.work, encoder)], gallery)
        fitted = replace(gallery, calibration=replace(gallery.calibration, flat=factor))
        save_gallery(fitted, chosen.fit / FILE_NAME)
        print(f"{encoder.name}: flat pictures, scale times {factor:.2f}")
        return 0
    report(kits, gallery)
    return 0


def read(folder: Path, encoder: Encoder) -> Kits:
    """Embed the crops of every file of a folder, in the order of their names."""
    rows = []
    flat = []
    labels: list[str] = []
    paths: list[str] = []
    for path in sorted(folder.glob("*.npz")):
        with np.load(path) as file:
            labels += file["label"].tolist()
            paths += file["path"].tolist()
            drawn = [Crop(big[..., :3].copy(), big[..., 3].copy()) for big in file["big"]]
        flat += [is_flat(crop) for crop in drawn]
        rows.append(encoder.embed([_at(crop, encoder.side) for crop in drawn]))
    return Kits(np.concatenate(rows), np.array(flat), np.array(labels), np.array(paths))


def judging(data: Path, work: Path, encoder: Encoder) -> list[Kits]:
    """Embed the sets that choose and calibrate, but those of which nothing is drawn."""
    parts = []
    for name, labelled in describing.judging(data, work, encoder.side).items():
        shown = [(encoder.embed([crop])[0], is_flat(crop), label) for crop, label, _ in labelled]
        if shown:
            rows, flat, labels = zip(*shown, strict=True)
            paths = np.full(len(shown), f"{name}/")
            parts.append(Kits(np.stack(rows), np.array(flat), np.array(labels), paths))
    return parts


def _at(crop: Crop, side: int) -> Crop:
    """Return a crop of this side, px: not every encoder takes the side that the files have."""
    if crop.mask.shape[0] == side:
        return crop
    image = Image.fromarray(crop.image).resize((side, side), Image.Resampling.BILINEAR)
    mask = Image.fromarray(crop.mask).resize((side, side), Image.Resampling.NEAREST)
    return Crop(np.asarray(image), np.asarray(mask))


def fit(parts: Sequence[Kits], gallery: Gallery) -> float:
    """Return the factor of least surprise over the flat pictures of these parts, equally."""
    flat = [part.keep(part.flat) for part in parts]
    return min(FACTORS, key=lambda factor: sum(_surprise(each, gallery, factor) for each in flat))


def _surprise(flat: Kits, gallery: Gallery, factor: float) -> float:
    beliefs = _with_flat(gallery, factor).beliefs(flat.embeddings, flat.flat)
    total = 0.0
    for admitted in (FOUR, ALL):
        kept, truth = _judged(beliefs, flat, gallery, admitted)
        right = np.maximum(kept[np.arange(len(truth)), truth], LEAST)
        each = [np.log(right[truth == label]).mean() for label in np.unique(truth)]
        total -= float(np.mean(each))
    return total


def report(kits: Kits, gallery: Gallery) -> None:
    """Print a line for each kit and all of them, with four and with all materials admitted."""
    plain = _with_flat(gallery, 1.0)
    ways = {
        "pictures alone": _alone(kits, plain),
        "with the scale of flat pictures": _alone(kits, gallery),
        "beside named objects": _beside(kits, plain, weighs_flat=False),
        "beside named objects, with both": _beside(kits, gallery, weighs_flat=True),
    }
    for kit in (*np.unique(kits.kits), "all"):
        rows = np.full(len(kits.truth), kit == "all") | (kits.kits == kit)
        shown = kits.keep(rows)
        print(f"\n{kit}: {len(shown.truth)} crops, {shown.flat.mean():.0%} flat")
        for way, beliefs in ways.items():
            cells = [_cell(beliefs[rows], shown, gallery, admitted) for admitted in (FOUR, ALL)]
            print(f"  {way:<34} of 4: {cells[0]}   of {len(ALL)}: {cells[1]}")


def _alone(kits: Kits, gallery: Gallery) -> Doubles:
    return gallery.beliefs(kits.embeddings, kits.flat)


def _beside(kits: Kits, gallery: Gallery, *, weighs_flat: bool) -> Doubles:
    """Return beliefs in each crop, beside up to NAMED named objects of its kit.

    `weighs_flat`: the references weigh more where the crop is flat.
    """
    dice = np.random.default_rng(SEED)
    alone = _alone(kits, gallery)
    stems = [Path(path).stem for path in kits.paths]
    families = np.array([" ".join(_VARIANT.sub(" ", stem.lower()).split()) for stem in stems])
    named = np.array([_named(stem) for stem in stems])
    rows = []
    for row in range(len(stems)):
        others = (kits.kits == kits.kits[row]) & (families != families[row]) & (named != UNKNOWN)
        references = SceneReferences()
        for path in dice.permutation(np.unique(kits.paths[others]))[:NAMED]:
            view = int(np.flatnonzero(kits.paths == path)[0])
            references.add(str(path), str(named[view]), kits.embeddings[view])
        pairs = zip(gallery.candidates, alone[row].tolist(), strict=True)
        evidence = Evidence("encoder", tuple(sorted(pairs, key=lambda pair: -pair[1])))
        is_weighed = weighs_flat and bool(kits.flat[row])
        adjusted = references.adjust(evidence, kits.embeddings[row], None, is_flat=is_weighed)
        rows.append([dict(adjusted.beliefs).get(name, 0.0) for name in gallery.candidates])
    return np.array(rows)


def _named(stem: str) -> str:
    evidence: Evidence | None = names.from_name(stem)
    return UNKNOWN if evidence is None else ladder.decide([evidence]).material


def _cell(beliefs: Doubles, kits: Kits, gallery: Gallery, admitted: Sequence[str]) -> str:
    kept, truth = _judged(beliefs, kits, gallery, admitted)
    if not len(truth):
        return "none"
    right = kept.argmax(axis=1) == truth
    said = kept.max(axis=1) >= ladder.KNOWN
    forced = np.mean([right[truth == label].mean() for label in np.unique(truth)])
    of_said = f"{right[said].mean():.2f}" if said.any() else " -  "
    return f"n {len(truth):>4} forced {forced:.2f} said {said.mean():.2f} right {of_said}"


def _judged(
    beliefs: Doubles, kits: Kits, gallery: Gallery, admitted: Sequence[str]
) -> tuple[Doubles, NDArray[np.int64]]:
    """Return the beliefs in the admitted, (M, C), and the truth of the crops of these, (M,)."""
    rows = np.isin(kits.truth, admitted)
    kept = beliefs[rows][:, [gallery.candidates.index(name) for name in admitted]]
    # What is not admitted is dropped, and unknown keeps its share beside what is left.
    unknown = np.maximum(1.0 - beliefs[rows].sum(axis=1, keepdims=True), 0.0)
    kept = kept / (kept.sum(axis=1, keepdims=True) + unknown)
    return kept, np.array([list(admitted).index(name) for name in kits.truth[rows]], np.int64)


def _with_flat(gallery: Gallery, factor: float) -> Gallery:
    return replace(gallery, calibration=replace(gallery.calibration, flat=factor))


if __name__ == "__main__":
    sys.exit(main())
