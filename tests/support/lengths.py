"""Orders the tests so that the workers end together, by the seconds that each file took before.

`.ci/seconds.json` has them. A worker takes a whole file at a time, the longest file first. The
tests of a file marked `spread` share nothing that is costly to make, so any worker takes any of
them. Files that drive a browser, which draws on the processor with many threads, are mixed evenly
with the others: three browsers at once make each other late.

Each run measures again; `.ci/tests seconds` keeps what the runs since `make clean` measured. The
night's tests of a file count by themselves.
"""

from __future__ import annotations

import json
import re
from collections import defaultdict
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[2]
KEPT = ROOT / ".ci" / "seconds.json"
SPREAD = re.compile(r"^pytestmark = .*pytest\.mark\.spread\b", re.MULTILINE)
DRAWN = ("tests/browser/", "tests/engines/")
MEASURED = ROOT / ".pytest_cache" / "seconds.json"
measured: dict[str, float] = defaultdict(float)


@pytest.hookimpl(trylast=True)  # when what this pass leaves out is gone: the night's have their own
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with the longest file, or with the longest test of one that is `spread`."""
    seconds = json.loads(KEPT.read_text(encoding="utf-8"))
    groups: dict[str, list[pytest.Item]] = defaultdict(list)
    for item in items:
        groups[scope(item.nodeid)].append(item)
    lengths = {
        name: seconds.get(_key(name, group[0].keywords), 1.0) for name, group in groups.items()
    }
    longest_first = sorted(groups, key=lambda name: -lengths[name])
    drawn = [name for name in longest_first if name.startswith(DRAWN)]
    others = [name for name in longest_first if not name.startswith(DRAWN)]
    items[:] = [item for name in _mixed(drawn, others, lengths) for item in groups[name]]


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """Give a worker a file at a time, or a test of one that is `spread`."""
    from xdist.scheduler import LoadScopeScheduling  # type: ignore[import-untyped]

    class Scheduling(LoadScopeScheduling):  # type: ignore[misc]
        def _split_scope(self, nodeid: str) -> str:
            return scope(nodeid)

    return Scheduling(config, log)


def scope(nodeid: str) -> str:
    """Return what is run by one worker: the test's file, or the test if its file is `spread`."""
    file = nodeid.partition("::")[0]
    return nodeid if _is_spread(file) else file


@cache
def _is_spread(file: str) -> bool:
    return bool(SPREAD.search((ROOT / file).read_text(encoding="utf-8")))


def _mixed(one: list[str], other: list[str], lengths: dict[str, float]) -> Iterator[str]:
    """Yield the names of both lists in their order, so that both are used up evenly."""
    left = [sum(lengths[name] for name in names) or 1.0 for names in (one, other)]
    whole = tuple(left)
    queues = [list(reversed(one)), list(reversed(other))]
    while any(queues):
        turn = int(not queues[0] or (bool(queues[1]) and left[1] / whole[1] > left[0] / whole[0]))
        name = queues[turn].pop()
        left[turn] -= lengths[name]
        yield name


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
