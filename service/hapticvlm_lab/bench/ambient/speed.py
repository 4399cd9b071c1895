"""What an answer costs in seconds: reading it off one pass against writing it out.

The methods are timed in turn on the same picture, so a busy machine disturbs all alike. Beside the
clock stands the time of the cores, which does not count waiting for other processes. Works with any
model in process, whatever its weights.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from hapticvlm.recognition.vlm import contract
from hapticvlm.recognition.vlm.chat import Chat
from hapticvlm.recognition.vlm.contract import Picture
from hapticvlm.recognition.vlm.network import Network
from hapticvlm.recognition.vlm.numbers import beliefs, number_tree, spread

NUMBER_TOKENS = 3  # two digits, or sign and digit, and the end
SENTENCE_TOKENS = 25

READ, READ_ONE, READ_ANEW = "readout, 2 wordings", "readout", "readout, head anew"
NUMBER, NUMBER_ANEW = "bare number", "bare number, head anew"
SENTENCE, SENTENCE_ANEW = "25-token sentence", "25 tokens, head anew"


@dataclass(frozen=True, slots=True)
class Timing:
    """Of one method over n turns, s: median and least by the clock, median of the cores' time."""

    wall: float
    least: float
    cores: float
    n: int


def methods(network: Network, chat: Chat, picture: Picture) -> dict[str, Callable[[], object]]:
    """List the methods to answer how warm a picture is, from picture to answer each."""
    anew = Network(network.model, keeps_heads=False)
    tree = number_tree(chat.encode)

    def read(by: Network, wordings: int) -> Callable[[], object]:
        asked = contract.about_ambient(wordings)
        return lambda: spread(
            [beliefs(tree, logits) for logits in by.readout(chat.prompt(asked, [picture]), tree)]
        )

    def write(by: Network, tokens: int) -> Callable[[], object]:
        asked = contract.about_ambient(1)
        return lambda: chat.decode(by.write(chat.prompt(asked, [picture]), tokens))

    return {
        READ_ONE: read(network, 1),
        READ: read(network, 2),
        READ_ANEW: read(anew, 1),
        NUMBER: write(network, NUMBER_TOKENS),
        NUMBER_ANEW: write(anew, NUMBER_TOKENS),
        SENTENCE: write(network, SENTENCE_TOKENS),
        SENTENCE_ANEW: write(anew, SENTENCE_TOKENS),
    }


def time_in_turn(
    methods: Mapping[str, Callable[[], object]], most_turns: int, most_s: float
) -> dict[str, Timing]:
    """Time all methods once a turn, after one warm-up of the first; at least one turn."""
    walls: dict[str, list[float]] = {name: [] for name in methods}
    cores: dict[str, list[float]] = {name: [] for name in methods}
    next(iter(methods.values()))()
    start = time.perf_counter()
    for turn in range(most_turns):
        spent = time.perf_counter() - start
        if turn and spent + spent / turn > most_s:
            break
        for name, answer in methods.items():
            wall, core = time.perf_counter(), time.process_time()
            answer()
            cores[name].append(time.process_time() - core)
            walls[name].append(time.perf_counter() - wall)
    return {
        name: Timing(
            wall=float(np.median(walls[name])),
            least=min(walls[name]),
            cores=float(np.median(cores[name])),
            n=len(walls[name]),
        )
        for name in methods
    }


def print_table(image_tokens: int, timings: Mapping[str, Timing]) -> None:
    """Print a row for each method, and how many times the readout's time it takes."""
    print(f"\n== {image_tokens} image tokens, s")
    print(f"{'way':<26}{'median':>9}{'least':>9}{'cores':>9}{'n':>4}{'x least':>9}{'x cores':>9}")
    base = timings[READ_ONE]
    for name, row in timings.items():
        times = f"{row.least / base.least:>9.2f}{row.cores / base.cores:>9.2f}"
        print(f"{name:<26}{row.wall:>9.3f}{row.least:>9.3f}{row.cores:>9.3f}{row.n:>4}{times}")


def ratios(timings: Mapping[str, Timing], by: str = "least") -> dict[str, float]:
    """Return how many times faster a readout is, by `least` or `cores`.

    Against writing a number or a sentence as `generate` does, and with the head kept as ours does.
    """

    def times(name: str) -> float:
        return round(float(getattr(timings[name], by) / getattr(timings[READ_ONE], by)), 3)

    return {
        "number": times(NUMBER_ANEW),
        "number_kept": times(NUMBER),
        "sentence": times(SENTENCE_ANEW),
        "sentence_kept": times(SENTENCE),
    }


def share_saved(timings: Mapping[str, Timing], by: str = "least") -> float:
    """Return which share of a readout the kept head saves, 0..1."""
    kept, anew = (float(getattr(timings[name], by)) for name in (READ_ONE, READ_ANEW))
    return round(1.0 - kept / anew, 3)


def picture(height: int, width: int) -> Picture:
    """Draw random blocks of 8 px: (height, width, 3) uint8."""
    rng = np.random.default_rng(5)
    blocks = rng.integers(0, 255, (height // 8, width // 8, 3), np.uint8)
    drawn: Picture = np.kron(blocks, np.ones((8, 8, 1), np.uint8))
    return drawn


def shape_for(image_tokens: int) -> Sequence[int]:
    """Choose a picture's height and width, px, that become exactly so many tokens of 28 x 28."""
    rows = max(row for row in range(1, image_tokens + 1) if _fits(row, image_tokens))
    return 2 * 28 * rows, 2 * 28 * (image_tokens // rows)


def _fits(rows: int, image_tokens: int) -> bool:
    return image_tokens % rows == 0 and rows * rows <= image_tokens
