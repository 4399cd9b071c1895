"""The recipe of each picture of docs/: a command of the project, or a page in a real browser.

The pictures in KEPT have no recipe: a film is put together by hand.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from hapticvlm_lab.bench.material.data import SIBLING
from hapticvlm_lab.bench.pictures import pages

Recipe = Callable[[Path, Path], None]  # (folder to work in, picture to write)


def _command(name: str, *arguments: str) -> Recipe:
    """Run `hapticvlm ARGUMENTS --out FOLDER` and take the picture of this name from the folder."""

    def make(folder: Path, picture: Path) -> None:
        _run("hapticvlm", *arguments, "--out", str(folder))
        shutil.copyfile(folder / name, picture)

    return make


def _whole(folder: Path, picture: Path) -> None:
    """Draw the game kits that are left out, where the data is, then the chart with them."""
    kits: list[str] = []
    if SIBLING.is_dir():
        kits = ["--kits", str(folder / "kits")]
        drawing = ("--data", str(SIBLING), "--work", str(folder / "kits"))
        _run("hapticvlm_lab.training", "--only", "held-back", *drawing)
    _command("chart-whole.png", "chart", "whole", *kits)(folder, picture)


def _run(module: str, *arguments: str) -> None:
    subprocess.run([sys.executable, "-m", module, *arguments], check=True)


RECIPES: Mapping[str, Recipe] = {
    "dashboard.png": pages.dashboard,
    "try.png": pages.feel_this,
    "webxr.png": pages.webxr,
    "chart-whole.png": _whole,
    "chart-material.png": _command("chart-material.png", "chart", "material"),
    "chart-thermal.png": _command("chart-thermal.png", "chart", "thermal"),
    "chart-vibration.png": _command("chart-vibration.png", "chart", "vibration"),
    "stability-material.png": _command(
        "stability-material-report_web.png", "stability", "material"
    ),
    "stability-conventions.png": _command(
        "stability-conventions.png",
        *("stability", "conventions", str(SIBLING / "report_web"), "--limit", "200"),
    ),
    "stability-latency.png": _command("stability-latency.png", "stability", "latency"),
    "paper-confusion.svg": _command("confusion.svg", "study", "report", "--paper"),
    "paper-recognition.png": _command("recognition.png", "study", "report", "--paper"),
    "study-page.png": pages.study,
    "study-experimenter.png": pages.experimenter,
}

KEPT = frozenset({"demo.webp"})


def names(wanted: Sequence[str]) -> list[str]:
    """Return the names of the pictures to draw, all if none is named. Raises KeyError."""
    unknown = [name for name in wanted if name not in RECIPES]
    if unknown:
        raise KeyError(f"{', '.join(unknown)}: the pictures are {', '.join(RECIPES)}")
    return list(wanted) or list(RECIPES)
