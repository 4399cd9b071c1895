"""Boards with the compiled firmware."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from toolchains import require

from . import build
from .board import Board
from .build import Chip
from .rawhost import RawHost


@pytest.fixture(scope="session")
def chip() -> Chip:
    """The firmware and the host of the simulated chip, compiled once."""
    require("simavr", "make")
    return build.shared()


@pytest.fixture
def board(chip: Chip) -> Iterator[Board]:
    board = chip.board()
    yield board
    board.close()


@pytest.fixture
def host(board: Board) -> RawHost:
    """A host after its HELLO; the bridge is off."""
    host = RawHost(board)
    host.greet()
    return host
