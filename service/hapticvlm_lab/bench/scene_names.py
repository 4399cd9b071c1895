"""Material from the names of real scenes: how often it speaks, is right, and means what it says.

Reads a CSV with the columns `scene`, `name` and `expected`: a material, alternatives ("metal or
wood"), "?" (a thing whose material the name does not tell) or anything else for names of no
material (UI, lights, markers; water and animals, which have no class). People judge by eye, so
nothing is derived from the name itself.

Four shares are reported, each with its 95 % Wilson interval:

- *matter*: right, of names of materials that it speaks on;
- *all*: right, of all that it speaks on and that can be judged;
- *sure*: the same, of those believed SURE or more, which end the ladder before any picture;
- *spoke*: spoken on, of names that tell a material.

It speaks if its belief is at least KNOWN. Belief is scaled by ground (`belief` in names.toml), and
a scale fitted on the names that it is then judged on flatters itself. So each scene is judged with
the scale of the other scenes. The word lists are not fitted; whether their author had read a scene
must be said beside the figures.
"""

from __future__ import annotations

import csv
import json
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import pairwise
from pathlib import Path

from hapticvlm import materials
from hapticvlm.evidence import names
from hapticvlm.evidence.ladder import KNOWN, SURE
from hapticvlm.evidence.lexicon import GROUNDS, Ground, Lexicon, read_lexicon
from hapticvlm.statistics import wilson

COLUMNS = ("scene", "name", "expected")
# Before any name was seen, a ground counts as right on 3 names of 4; this weighs PRIOR_COUNT names.
PRIOR_SHARE, PRIOR_COUNT = 0.75, 2.0
# Largest factor of a ground. What is usual in a few scenes must not make "Table" so sure that no
# picture is asked; and before an unknown head a class word stays unsure, and a thing unsaid.
MOST: Mapping[Ground, float] = {"stuff_before_unknown": 0.7, "thing_before_unknown": 0.45}
EDGES = (KNOWN, 0.7, SURE, 0.9, 1.01)


@dataclass(frozen=True, slots=True)
class SceneName:
    """A name of a scene; `truths` are the materials that are right, None if it cannot be told."""

    scene: str
    text: str
    truths: frozenset[str] | None


Answer = tuple[SceneName, str | None, float]  # the material, if any, and the belief in it


@dataclass(frozen=True, slots=True)
class Share:
    """A share 0..1 of `n` names with its 95 % interval; None if n is 0."""

    right: int
    n: int

    @property
    def value(self) -> float | None:
        """The share itself."""
        return self.right / self.n if self.n else None

    def __str__(self) -> str:
        if not self.n:
            return "- (n = 0)"
        low, high = wilson(self.right, self.n)
        return f"{self.right / self.n:.0%} [{low:.0%}, {high:.0%}] (n = {self.n})"


@dataclass(frozen=True, slots=True)
class SceneScore:
    """The four shares of the module's docstring."""

    matter: Share
    all: Share
    sure: Share
    spoke: Share


def run(path: Path, as_json: bool) -> int:
    """Print the shares, left-one-scene-out, and the scale of all scenes; return 2 on a bad file."""
    try:
        rows = read(path)
    except (OSError, ValueError) as error:
        print(f"{path}: {error}")
        return 2
    lexicon = read_lexicon(materials.MATERIALS)
    scenes = sorted({row.scene for row in rows})
    answers = {scene: _left_out(rows, scene, lexicon) for scene in scenes}
    report = {
        "all scenes": score([pair for scene in scenes for pair in answers[scene]]),
        **{scene: score(answers[scene]) for scene in scenes},
    }
    scale = fit(rows, lexicon)
    if as_json:
        shares = {scene: asdict(line) for scene, line in report.items()}
        print(json.dumps({"measure": "scene names", "scenes": shares, "belief": scale}))
        return 0
    print(f"{len(rows)} names of {len(scenes)} scenes; each scene with the beliefs of the others")
    for scene, line in report.items():
        print(f"\n{scene}\n  matter {line.matter}\n  all    {line.all}")
        print(f"  sure   {line.sure}\n  spoke  {line.spoke}")
    print("\nbelief, all scenes")
    for count, belief, right in bins([pair for scene in scenes for pair in answers[scene]]):
        print(f"  {belief:.2f}: right {right:.2f} (n = {count})")
    print("\nbelief of each ground, fitted on all scenes (names.toml has what is shipped):")
    for ground, factor in scale.items():
        print(f"  {ground} = {factor:.2f}  # shipped {lexicon.scale[ground]:.2f}")
    return 0


def read(path: Path) -> list[SceneName]:
    """Read a CSV of names. Raises ValueError if a column is missing, OSError if unreadable."""
    with path.open(newline="", encoding="utf-8") as file:
        reader = csv.DictReader(file)
        missing = [column for column in COLUMNS if column not in (reader.fieldnames or ())]
        if missing:
            raise ValueError(f"no column {', '.join(missing)}; the header must have {COLUMNS}")
        return [SceneName(r["scene"], r["name"], _truths(r["expected"])) for r in reader]


def score(answers: Iterable[Answer]) -> SceneScore:
    """Return the four shares of these answers."""
    counts: Counter[str] = Counter()
    for name, material, belief in answers:
        spoke = material is not None and belief >= KNOWN
        if name.truths is None:
            continue
        if name.truths:
            counts["tell"] += 1
            counts["spoke"] += spoke
        if not spoke:
            continue
        right = material in name.truths
        counts["all"] += 1
        counts["right"] += right
        counts["matter"] += bool(name.truths)
        counts["sure"] += belief >= SURE
        counts["sure right"] += right and belief >= SURE
    return SceneScore(
        matter=Share(counts["right"], counts["matter"]),
        all=Share(counts["right"], counts["all"]),
        sure=Share(counts["sure right"], counts["sure"]),
        spoke=Share(counts["spoke"], counts["tell"]),
    )


def bins(answers: Iterable[Answer]) -> list[tuple[int, float, float]]:
    """Return (n, mean belief, share right) between EDGES, of names that can be judged."""
    judged = [(name.truths, m, belief) for name, m, belief in answers if name.truths is not None]
    rows = []
    for low, high in pairwise(EDGES):
        inside = [(belief, m in truths) for truths, m, belief in judged if low <= belief < high]
        if inside:
            beliefs, rights = zip(*inside, strict=True)
            rows.append((len(inside), sum(beliefs) / len(inside), sum(rights) / len(inside)))
    return rows


def fit(rows: Sequence[SceneName], lexicon: Lexicon) -> dict[Ground, float]:
    """Return each ground's factor: its share of right names over its mean belief, at most MOST."""
    right: dict[Ground, float] = defaultdict(float)
    believed: dict[Ground, list[float]] = defaultdict(list)
    for row in rows:
        reading = names.read(row.text, lexicon)
        if reading is None or row.truths is None:
            continue
        best = max(reading.beliefs, key=lambda name: reading.beliefs[name])
        believed[reading.ground].append(reading.beliefs[best])
        right[reading.ground] += best in row.truths
    return {
        ground: min(MOST.get(ground, 1.0), _factor(right[ground], believed[ground]))
        for ground in GROUNDS
    }


def _factor(right: float, believed: Sequence[float]) -> float:
    if not believed:
        return 1.0
    share = (right + PRIOR_SHARE * PRIOR_COUNT) / (len(believed) + PRIOR_COUNT)
    return round(share / (sum(believed) / len(believed)), 2)


def _left_out(rows: Sequence[SceneName], scene: str, lexicon: Lexicon) -> list[Answer]:
    """Answer a scene's names with the scale that the other scenes give."""
    scale = fit([row for row in rows if row.scene != scene], lexicon)
    return _answers([row for row in rows if row.scene == scene], lexicon, scale)


def _answers(
    rows: Sequence[SceneName], lexicon: Lexicon, scale: Mapping[Ground, float]
) -> list[Answer]:
    scaled = replace(lexicon, scale=scale)
    evidence = [(row, names.from_name(row.text, scaled)) for row in rows]
    return [(row, e.material, e.confidence) if e else (row, None, 0.0) for row, e in evidence]


def _truths(expected: str) -> frozenset[str] | None:
    if expected in ("?", "two materials"):
        return None
    return frozenset(expected.split(" or ")) & materials.MATERIALS.keys()
