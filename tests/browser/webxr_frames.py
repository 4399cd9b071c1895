"""What pictures alone tell of the WebXR scene: every object from many viewpoints, held back.

    python tests/browser/webxr_frames.py --views 6

The scene takes each picture as it does when a hand is at an object (`frameCamera`); the shipped
encoder, gallery and ladder judge it. Viewpoints come from a seed; the scene's looks were chosen on
those of seed 101 and are reported on those of seed 202. Beside the shipped gallery stand two with
pictures of this scene from the choosing viewpoints as own references: of the same things, and
of the other things of the material only. Prints a table and, last, one JSON line.
"""

from __future__ import annotations

import argparse
import base64
import json
import os
import platform
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from toolchains import missing
from webxr_scene import visiting

from hapticvlm.evidence.ladder import Evidence, decide, fuse_recognitions, restrict
from hapticvlm.materials import MATERIALS, Thermal
from hapticvlm.messages import Frame
from hapticvlm.perception import NEUTRAL_C
from hapticvlm.rendering.heat.contact import contact_temperature_c, thermal_contact
from hapticvlm.session.decisions import choose_rendition
from hapticvlm.vision import pictures
from hapticvlm.vision.encoders.encoder import Encoder
from hapticvlm.vision.flatness import is_flat
from hapticvlm.vision.galleries.calibration import FEW, calibrate
from hapticvlm.vision.galleries.gallery import Gallery
from hapticvlm.vision.galleries.storage import load_gallery
from hapticvlm.vision.loading import load_encoder

CHOOSING, HELD = 101, 202
FOUR = ("wood", "glass", "fabric", "metal")
ROOM_C = 22.0
ALIKE_C = 1.0  # degC of contact temperature: wood and fabric differ by 1.3, all metals by less
NEAREST, FARTHEST = (-0.55, 1.15, 0.3), (0.55, 1.7, 0.85)  # m, where the head may be: x, y, z
LOOK = """async ({main}, [key, x, y, z]) => {
  const object = main.objects.find((one) => one.key === key);
  const frame = await main.frameCamera.frame(object, {x, y, z});
  const text = (bytes) => btoa(Array.from(bytes, (byte) => String.fromCharCode(byte)).join(''));
  return frame && {...frame, image: text(frame.image), mask: text(frame.mask)};
}"""

Floats = NDArray[np.float32]


@dataclass(frozen=True)
class Shot:
    """One picture of an object: (D,) embedding, and whether it is flat, beside what it truly is."""

    key: str
    truth: str
    embedding: Floats
    is_flat: bool


@dataclass(frozen=True)
class Judged:
    """What one picture was taken for: by the ladder, of all materials, of the scene's four."""

    truth: str
    said: str
    best: str
    best_of_four: str
    top_three: tuple[tuple[str, float], ...]
    evidence: Evidence


def judge(shot: Shot, gallery: Gallery) -> Judged:
    """Decide on one picture as the service does, and look past what it dares to say."""
    evidence = gallery.match(shot.embedding, is_flat=shot.is_flat)
    among = restrict(evidence, FOUR)  # what the scene states that it can be made of
    return Judged(
        truth=shot.truth,
        said=decide([among]).material,
        best=evidence.material or "none",
        best_of_four=among.material or "none",
        top_three=among.beliefs[:3],
        evidence=among,
    )


def shoot(visit: Any, encoder: Encoder, places: Sequence[Floats], keep: Path | None) -> list[Shot]:
    """Take a picture of every object from every place; objects that are hidden give none."""
    shots = []
    for key, truth in visit.truths().items():
        for number, place in enumerate(places):
            fields = visit.modules.evaluate(LOOK, [key, *map(float, place)])
            if fields is None:
                continue
            image, mask = (base64.b64decode(fields.pop(name)) for name in ("image", "mask"))
            frame = Frame(id=1, captured_at=0.0, **fields, image=image, mask=mask)
            crop = pictures.crop(frame, encoder.side)
            shots.append(Shot(key, truth, encoder.embed([crop])[0], is_flat(crop)))
            if keep is not None:
                _write(keep / truth, f"{key.replace(' ', '_')}-{number}", image, mask)
    return shots


def heads(seed: int, count: int) -> list[Floats]:
    """Draw where heads are: (3,) each, m."""
    dice = np.random.default_rng(seed)
    return [dice.uniform(NEAREST, FARTHEST).astype(np.float32) for _ in range(count)]


def taught(gallery: Gallery, shots: Sequence[Shot]) -> Gallery:
    """Add these pictures to the references of their true materials."""
    names = tuple(sorted({shot.truth for shot in shots}))
    labels = np.array([names.index(shot.truth) for shot in shots])
    rows = np.stack([shot.embedding for shot in shots])
    own = Gallery(gallery.encoder, names, rows, labels, FEW, places=np.arange(len(shots)))
    return replace(gallery, user=replace(own, calibration=calibrate(own, gallery)))


def ways(shipped: Gallery, teaching: Sequence[Shot]) -> dict[str, Callable[[str], Gallery]]:
    """Name the galleries, each as what gives the one to judge an object of this key with."""
    same = taught(shipped, teaching)

    def others(key: str) -> Gallery:
        return taught(shipped, [shot for shot in teaching if shot.key != key])

    return {"shipped": lambda _: shipped, "same things": lambda _: same, "other things": others}


def felt_c(truth: str | None, found: Sequence[Judged]) -> float:
    """Contact temperature of an object in a room of 22 degC: the true one, or by all its views."""
    bulk: Thermal | None
    if truth is not None:
        bulk = MATERIALS[truth].thermal
    else:
        verdict = decide([fuse_recognitions([one.evidence for one in found])])
        bulk, _ = choose_rendition(verdict, MATERIALS).thermal(ROOM_C, MATERIALS)
    return NEUTRAL_C if bulk is None else contact_temperature_c(thermal_contact(bulk, ROOM_C))


def felt_right(judged: dict[str, list[Judged]]) -> dict[str, bool]:
    """Which objects feel as they are, or as a material that skin cannot tell from it."""
    return {
        key: abs(felt_c(None, found) - felt_c(found[0].truth, found)) <= ALIKE_C
        for key, found in judged.items()
    }


def table(judged: dict[str, list[Judged]]) -> Iterator[str]:
    """Yield a line per object."""
    yield f"{'object':<15}{'truth':<8}{'n':>3}{'right':>7}{'wrong':>7}{'best':>6}{'of 4':>6}  first"
    for key, found in judged.items():
        counts = "{n:>3}{right:>7}{wrong:>7}{best:>6}{best_of_four:>6}".format(**tally(found))
        first = ", ".join(f"{name} {share:.2f}" for name, share in found[0].top_three)
        yield f"{key:<15}{found[0].truth:<8}{counts}  {first}"


def tally(found: Sequence[Judged]) -> dict[str, int]:
    """Count what was said rightly, wrongly, and which best guesses were right."""
    return {
        "n": len(found),
        "right": sum(one.said == one.truth for one in found),
        "wrong": sum(one.said not in (one.truth, "unknown") for one in found),
        "best": sum(one.best == one.truth for one in found),
        "best_of_four": sum(one.best_of_four == one.truth for one in found),
    }


def _write(folder: Path, name: str, image: bytes, mask: bytes) -> None:
    """Keep a picture as `hapticvlm gallery build` reads it."""
    (folder / "masks").mkdir(parents=True, exist_ok=True)
    (folder / f"{name}.jpg").write_bytes(image)
    (folder / "masks" / f"{name}.png").write_bytes(mask)


def main() -> None:
    """Take the pictures, judge them and print what came of it."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--views", type=int, default=6, help="of each object (%(default)s)")
    parser.add_argument("--keep", type=Path, help="folder for the choosing viewpoints' pictures")
    arguments = parser.parse_args()
    if reason := missing("chromium", "three"):
        raise SystemExit(reason)
    encoder = load_encoder()
    with visiting() as visit:
        teaching = shoot(visit, encoder, heads(CHOOSING, arguments.views), arguments.keep)
        held = shoot(visit, encoder, heads(HELD, arguments.views), None)
    result: dict[str, Any] = {}
    for name, gallery_for in ways(load_gallery(encoder=encoder), teaching).items():
        judged: dict[str, list[Judged]] = {}
        for shot in held:
            judged.setdefault(shot.key, []).append(judge(shot, gallery_for(shot.key)))
        print(f"\nreferences: {name}", *table(judged), sep="\n")
        right = felt_right(judged)
        print(f"felt right: {sum(right.values())} of {len(right)}: {right}")
        result[name] = tally([one for found in judged.values() for one in found])
        result[name]["felt_right"], result[name]["objects"] = sum(right.values()), len(right)
    load = f"{os.cpu_count()} cpus, load {os.getloadavg()[0]:.1f}"
    surroundings = {"encoder": encoder.name, "python": platform.python_version(), "device": load}
    print(json.dumps(result | surroundings))


if __name__ == "__main__":
    main()
