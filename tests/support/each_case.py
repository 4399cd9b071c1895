"""Runs a test on every case of a grid and names all that fail: one test, not a thousand."""

from __future__ import annotations

import functools
import inspect
import itertools
from collections.abc import Callable, Iterable
from typing import Any


def each(**values: Iterable[Any]) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Call the test with every combination of these values of its parameters.

    Its other parameters are fixtures, which all cases share. A case fails by an AssertionError;
    anything else that is raised ends the test.
    """
    cases = itertools.product(*values.values())
    return _looped([dict(zip(values, case, strict=True)) for case in cases], tuple(values))


def each_row(
    names: tuple[str, ...], rows: Iterable[tuple[Any, ...]]
) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Call the test with every row of a table, whose columns are these parameters."""
    return _looped([dict(zip(names, row, strict=True)) for row in rows], names)


def _looped(
    cases: list[dict[str, Any]], names: tuple[str, ...]
) -> Callable[[Callable[..., None]], Callable[..., None]]:
    def decorate(test: Callable[..., None]) -> Callable[..., None]:
        @functools.wraps(test)
        def run(**fixtures: Any) -> None:
            offenders = []
            for case in cases:
                try:
                    test(**fixtures, **case)
                except AssertionError as error:
                    offenders.append(f"{case}: {error}")
            assert not offenders, "\n".join(offenders)

        signature = inspect.signature(test)
        fixtures = [value for name, value in signature.parameters.items() if name not in names]
        run.__signature__ = signature.replace(parameters=fixtures)  # type: ignore[attr-defined]
        return run

    return decorate
