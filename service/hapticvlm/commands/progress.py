"""Shows a person that a command is working: a line with a clock, or a bar that counts steps.

It is drawn on stderr and only on a terminal, so that pipes and JSON stay clean.
"""

from __future__ import annotations

import sys
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from typing import TypeVar

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

T = TypeVar("T")


@contextmanager
def working(text: str) -> Iterator[None]:
    """Show this text and a clock until the context ends."""
    with _bar(TextColumn("{task.description} ..."), TimeElapsedColumn()) as progress:
        progress.add_task(text, total=None)
        yield


def track(items: Collection[T], text: str) -> Iterator[T]:
    """Yield the items, with a bar that counts them."""
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn())
    with _bar(*columns, TimeElapsedColumn()) as progress:
        task = progress.add_task(text, total=len(items))
        for item in items:
            yield item
            progress.advance(task)


def _bar(*columns: TextColumn | BarColumn | MofNCompleteColumn | TimeElapsedColumn) -> Progress:
    console = Console(stderr=True)
    return Progress(
        *columns,
        console=console,
        transient=True,
        disable=not console.is_terminal,
        redirect_stdout=sys.stdout.isatty(),
    )
