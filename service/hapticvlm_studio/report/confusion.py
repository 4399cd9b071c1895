"""Draws confusion matrices as one SVG: of all patterns, and beside it those of the factors. Pure.

Shades are shares of the row, so that patterns presented more often do not look better; a row that
was never presented stays blank. Numbers are counts, which shares of few trials would hide. It needs
no drawing library, so that a report always has its first figure.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from html import escape

import numpy as np
from numpy.typing import NDArray

from hapticvlm.palette import BLUE, GRID, GROUND, INK, SOFT

Matrix = tuple[Sequence[str], NDArray[np.int64]]  # names (N,) and counts (N, N), presented first
CELL = 38.0  # px, of the whole matrix and of those of the factors
LETTER = 6.7  # px, the mean width of a letter at FONT
FONT = 12
GAP = 28.0  # between two matrices
EDGE = 12.0
HEAD = 26.0  # above a matrix, for its title
DARK = 0.55  # share of a row from which its number is white
_TILT = 40.0  # degrees, of the names below a matrix


def svg(title: str, whole: Matrix, parts: Sequence[tuple[str, Matrix]]) -> str:
    """Return the picture of the whole matrix and, beside it, those of the factors."""
    left, below = _margins(whole)
    main = _drawn(title, whole, EDGE, EDGE)
    width = EDGE + left + CELL * len(whole[0]) + GAP
    height = EDGE + HEAD + CELL * len(whole[0]) + below
    top = EDGE
    beside: list[str] = []
    right = width
    for name, matrix in parts:
        beside += _drawn(name, matrix, width, top)
        side, under = _margins(matrix)
        top += HEAD + CELL * len(matrix[0]) + under + GAP
        right = max(right, width + side + CELL * len(matrix[0]) + GAP)
    right = max(right, EDGE + LETTER * len(title) + EDGE)
    bottom = max(height, top)
    body = "\n".join([*main, *beside])
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{right:.0f}" height="{bottom:.0f}" '
        f'viewBox="0 0 {right:.0f} {bottom:.0f}" role="img" font-family="system-ui, sans-serif" '
        f'font-size="{FONT}" fill="{INK}">\n<title>{escape(title)}</title>\n'
        f'<rect width="100%" height="100%" fill="{GROUND}"/>\n{body}\n</svg>\n'
    )


def _margins(matrix: Matrix) -> tuple[float, float]:
    """Return the space for the names at the left and below, px."""
    longest = LETTER * max((len(name) for name in matrix[0]), default=0)
    return longest + 34.0, longest * float(np.sin(np.radians(_TILT))) + 44.0


def _drawn(title: str, matrix: Matrix, x: float, y: float) -> list[str]:
    """Return the elements of one matrix whose upper left corner is there."""
    names, counts = matrix
    left, below = _margins(matrix)
    size = CELL * len(names)
    at_x, at_y = x + left, y + HEAD
    middle = f'text-anchor="middle" fill="{SOFT}"'
    return [
        f'<text x="{x:.0f}" y="{y + 13:.0f}" font-weight="600">{escape(title)}</text>',
        *_cells(counts, at_x, at_y),
        *_names(names, at_x, at_y),
        f'<text transform="translate({x + 11:.0f} {at_y + size / 2:.0f}) rotate(-90)" {middle}>'
        "presented</text>",
        f'<text x="{at_x + size / 2:.0f}" y="{at_y + size + below - 12:.0f}" {middle}>'
        "answered</text>",
    ]


def _cells(counts: NDArray[np.int64], x: float, y: float) -> Iterator[str]:
    totals = counts.sum(axis=1)
    for (row, column), count in np.ndenumerate(counts):
        share = count / totals[row] if totals[row] else 0.0
        at_x, at_y = x + CELL * column, y + CELL * row
        yield (
            f'<rect x="{at_x:.0f}" y="{at_y:.0f}" width="{CELL:.0f}" height="{CELL:.0f}" '
            f'fill="{BLUE}" fill-opacity="{share:.3f}" stroke="{GRID}"/>'
        )
        if count:
            ink = GROUND if share > DARK else INK
            yield (
                f'<text x="{at_x + CELL / 2:.0f}" y="{at_y + CELL / 2 + 4:.0f}" '
                f'text-anchor="middle" fill="{ink}">{count}</text>'
            )


def _names(names: Sequence[str], x: float, y: float) -> Iterator[str]:
    end = y + CELL * len(names) + 14
    for at, name in enumerate(names):
        middle = CELL * (at + 0.5)
        yield (
            f'<text x="{x - 6:.0f}" y="{y + middle + 4:.0f}" text-anchor="end">'
            f"{escape(name)}</text>"
        )
        yield (
            f'<text transform="translate({x + middle + 4:.0f} {end:.0f}) rotate(-{_TILT:.0f})" '
            f'text-anchor="end">{escape(name)}</text>'
        )
