"""Boards with the compiled firmware."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from shared_build import built_once
from toolchains import require

from . import build
from .board import Board
from .build import Chip
from .rawhost import RawHost


@pytest.fixture(scope="session")
def chip(tmp_path_factory: pytest.TempPathFactory) -> Chip:
    """The firmware and the host of the simulated chip, compiled once."""
    require("simavr", "make")
    return build.opened(built_once(tmp_path_factory, "firmware", build.build))


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
