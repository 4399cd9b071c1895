"""Orders the tests so that the workers end together, by the seconds that each file took before.

`.ci/seconds.json` has them. A worker takes a whole file at a time, the longest file first. The
tests of a file marked `spread` share nothing that is costly to make: any worker takes any of them,
last of all, when the others have no long file left. Each run measures again; `.ci/tests seconds`
keeps what the runs since `make clean` measured. The night's tests of a file count by themselves.
"""

from __future__ import annotations

import json
from collections import defaultdict
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
KEPT = ROOT / ".ci" / "seconds.json"
MEASURED = ROOT / ".pytest_cache" / "seconds.json"
measured: dict[str, float] = defaultdict(float)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Keep a file's tests together, unless it is `spread`, and begin with the longest file."""
    seconds = json.loads(KEPT.read_text(encoding="utf-8"))
    lengths = {}
    for item in items:
        file = item.path.relative_to(ROOT).as_posix()
        is_spread = item.get_closest_marker("spread") is not None
        if not is_spread:
            item.add_marker(pytest.mark.xdist_group(file))
        lengths[item] = 0.0 if is_spread else seconds.get(_key(file, item.keywords), 0.0)
    items.sort(key=lambda item: -lengths[item])


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """Add up how long each file takes; with workers, their reports come together here."""
    measured[_key(report.nodeid.partition("::")[0], report.keywords)] += report.duration


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Keep what was measured, beside what earlier runs measured of other files."""
    if not hasattr(session.config, "workerinput"):
        before = json.loads(MEASURED.read_text(encoding="utf-8")) if MEASURED.exists() else {}
        MEASURED.parent.mkdir(exist_ok=True)
        MEASURED.write_text(json.dumps(before | measured), encoding="utf-8")


def _key(file: str, keywords: object) -> str:
    return f"{file} nightly" if "nightly" in keywords else file  # type: ignore[operator]
