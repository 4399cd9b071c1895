"""Render the set: `python -m hapticvlm_lab.training.held_back --data DIR --out FOLDER`.

Every object depends on its id alone. Existing pictures are left as they are, so that a stopped run
continues where it was.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from hapticvlm.captures import LINES, Recorder
from hapticvlm_lab.training.held_back import develop, renderer
from hapticvlm_lab.training.held_back.cameras import VIEWS
from hapticvlm_lab.training.held_back.catalogue import Catalogue, read_catalogue
from hapticvlm_lab.training.held_back.plan import ORBIT_FRAMES, Plan, approaches, orbits
from hapticvlm_lab.training.held_back.stage import seed_of, set_stage

OBJECTS = "objects.json"
_CHUNK = 15  # views a launch


@dataclass(frozen=True, slots=True)
class Job:
    """One of the two sets: picture side in px, samples a film pixel and half, JPEG quality."""

    name: str
    plans: list[Plan]
    frames: int
    side: int
    samples: int
    quality: int
    step_s: float
    pause_s: float


def jobs() -> dict[str, Job]:
    """Return both sets by name."""
    return {
        "approach": Job("approach", approaches(), VIEWS, 144, 6, 75, 0.15, 0.3),
        "orbit": Job("orbit", orbits(), ORBIT_FRAMES, 128, 6, 65, 0.05, 0.5),
    }


def main(arguments: Sequence[str] | None = None) -> int:
    """Read the command line, render what is missing, write both captures."""
    parser = argparse.ArgumentParser(prog="held_back", description=__doc__)
    parser.add_argument("--data", type=Path, required=True, help="folder with labels.csv")
    parser.add_argument("--out", type=Path, required=True, help="where the captures go")
    parser.add_argument("--set", choices=sorted(jobs()), help="one alone (default: both)")
    parser.add_argument("--limit", type=int, help="the first so many objects of a set")
    parser.add_argument("--variant", help="Mitsuba's variant (default: LLVM if found, or scalar)")
    chosen = parser.parse_args(arguments)
    catalogue = read_catalogue(chosen.data)
    sys.stderr.write(f"Mitsuba {renderer.start(chosen.variant)}\n")
    for name, job in jobs().items():
        if chosen.set in (None, name):
            make_set(job, catalogue, chosen.out / name, chosen.limit)
    return 0


def make_set(job: Job, catalogue: Catalogue, out: Path, limit: int | None = None) -> None:
    """Render the missing pictures of a set, then write its lines."""
    from rich.progress import track

    for folder in ("frames", "masks"):
        (out / folder).mkdir(parents=True, exist_ok=True)
    plans = job.plans[:limit]
    about = _read_about(out)
    for plan in track(plans, f"rendering {job.name}"):
        if not all((out / name).exists() for name in _files(plan, job)):
            about[plan.object_id] = make_object(plan, job, catalogue, out)
            _write_about(out, about)
    write_lines(job, plans, out)


def make_object(plan: Plan, job: Job, catalogue: Catalogue, out: Path) -> dict[str, Any]:
    """Render one object's pictures and masks; return its plan, substances and light."""
    stage = set_stage(plan, catalogue, circling=job.name == "orbit")
    seed = seed_of(plan.object_id)
    parts = []
    for start in range(0, len(stage.cameras), _CHUNK):
        some = replace(stage, cameras=stage.cameras[start : start + _CHUNK])
        parts.append(renderer.render(some, job.side, job.samples, seed + start * renderer.HALVES))
    halves = np.concatenate([part for part, _ in parts], axis=1)
    masks = np.concatenate([mask for _, mask in parts])
    pictures = develop.develop(halves, masks, np.random.default_rng(seed))
    for name, picture, mask in zip(_names(plan, job), pictures, masks, strict=True):
        (out / "masks" / f"{name}.png").write_bytes(develop.mask_png(mask))
        (out / "frames" / f"{name}.jpg").write_bytes(develop.jpeg(picture, job.quality))
    made_of = sorted({thing.surface.made_of for thing in stage.target})
    return {**asdict(plan), "made_of": made_of, "light": stage.surroundings}


def write_lines(job: Job, plans: list[Plan], out: Path) -> None:
    """Write capture.jsonl: one frame message a picture, objects one after another."""
    recorder = Recorder(out / LINES)
    now = 0.0
    for plan in plans:
        for name in _names(plan, job):
            frame = {
                "type": "frame",
                "captured_at": round(now, 6),
                "format": "jpeg",
                "width": job.side,
                "height": job.side,
                "origin": "top",
                "purpose": "live",
                "object_id": plan.object_id,
                "file": f"frames/{name}.jpg",
                "mask_file": f"masks/{name}.png",
            }
            recorder.write(now, frame, truth=plan.truth)
            now += job.step_s
        now += job.pause_s
    recorder.close()


def _names(plan: Plan, job: Job) -> list[str]:
    return [f"{plan.object_id}_{number:02d}" for number in range(job.frames)]


def _files(plan: Plan, job: Job) -> list[str]:
    names = _names(plan, job)
    return [f"frames/{name}.jpg" for name in names] + [f"masks/{name}.png" for name in names]


def _read_about(out: Path) -> dict[str, Any]:
    path = out / OBJECTS
    about: dict[str, Any] = json.loads(path.read_text("utf-8")) if path.exists() else {}
    return about


def _write_about(out: Path, about: dict[str, Any]) -> None:
    rows = ",\n".join(f"{json.dumps(key)}: {json.dumps(about[key])}" for key in sorted(about))
    (out / OBJECTS).write_text(f"{{\n{rows}\n}}\n", encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())
