"""Cases that repeat one behaviour: some run in `make test`, the others in `make nightly`."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import pytest


def nightly_except(every: int, cases: Iterable[Any]) -> list[Any]:
    """Leave one case in `every` to `make test`, the first among them; mark the others `nightly`."""
    return [_nightly(case) if number % every else case for number, case in enumerate(cases)]


def _nightly(case: Any) -> Any:
    return pytest.param(*(case if isinstance(case, tuple) else (case,)), marks=pytest.mark.nightly)
