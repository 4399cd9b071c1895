"""Computes exact probabilities of candidate answers, and a temperature from those of numbers. Pure.

*Beliefs.* The belief in a candidate is the probability that the answer begins with it and not with
a longer candidate: that in "2" is the probability of a 2 without a digit after it that makes it 20.
For a text x of tokens x_1..x_n it is

  b(x) = prod_i p(x_i | x_1..x_i-1) * (1 - sum of p(t | x) over t that lead on to a candidate),

so it does not matter what a model appends (an end, a degree sign, a full stop). All candidates can
be scored from the next-token distributions after each text that leads on to one. These texts are
the nodes of a tree. For whole numbers from -30 to 60 in tokens of single digits there are ten
beside the root: "-", "1" to "6" and "-1" to "-3". Only the tokenizer's own split of a text counts;
the same text split into other tokens does not.

*One pass.* Read naively, a model would run once for each wording and node, with nearly the same
tokens each time. Instead all of them are packed into one forward pass (tree attention: Miao et al.,
SpecInfer, ASPLOS 2024, arXiv 2305.09781). The sequence is the part that all wordings share (with
the picture, which is nearly all of the cost), then for each wording its remaining tokens and the
nodes of the tree, one after the other. Two things make the result exact. An attention mask lets
each token attend only to the tokens that would precede it if its wording and its node stood alone.
And its position number is the one that it would have then, so several tokens share a position. The
next-token distributions are therefore those of separate passes.

*Temperature.* A belief in n degC is spread evenly over n - 0.5 to n + 0.5, so that quantiles are
continuous, and a model that is sure of one number still has an interval of a degree. Knows no
model.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hapticvlm.evidence.reading import COVERAGE, Reading
from hapticvlm.vlm.contract import VlmError
from hapticvlm.vlm.limits import LEAST_C, LEAST_SHARE, MOST_C

Encode = Callable[[str], Sequence[int]]
Text = tuple[int, ...]

CANDIDATES_C = np.arange(LEAST_C, MOST_C + 1)  # degC

Beliefs = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class ChoiceTree:
    """Candidate texts as tokens, and their beginnings, after which the next token is needed.

    nodes: the root () first, then every beginning that leads on, parents before children.
    texts: (tokens, answer) pairs; several texts may mean one answer. answers: their number.
    """

    nodes: tuple[Text, ...]
    texts: tuple[tuple[Text, int], ...]
    answers: int

    def parent(self, node: int) -> int:
        """Return the index of the node one token shorter; the root has no parent."""
        return self.nodes.index(self.nodes[node][:-1])


def choice_tree(spellings: Mapping[str, int], encode: Encode) -> ChoiceTree:
    """Build the tree of spellings, each with the index of the answer that it means.

    Raises ValueError if a spelling has no tokens, or if two answers have the same tokens.
    """
    texts: dict[Text, int] = {}
    for spelling, answer in spellings.items():
        tokens = tuple(encode(spelling))
        if not tokens or texts.get(tokens, answer) != answer:
            raise ValueError(f"the tokenizer does not distinguish `{spelling}` from other answers")
        texts[tokens] = answer
    inner = {text[:length] for text in texts for length in range(len(text))}
    nodes = tuple(sorted(inner, key=lambda text: (len(text), text)))
    return ChoiceTree(nodes, tuple(texts.items()), 1 + max(texts.values()))


@dataclass(frozen=True, slots=True)
class Packed:
    """The T tokens after the shared part: K wordings with N nodes each.

    ids: (T,) int64. steps: (T,) int64, each token's position after the end of the shared part,
    from 0. sees: (T, T) bool, whether a row attends to a column. rows: (K, N) int64, the token
    after which a node's next token is read.
    """

    ids: NDArray[np.int64]
    steps: NDArray[np.int64]
    sees: NDArray[np.bool_]
    rows: NDArray[np.int64]


def pack(tails: Sequence[Sequence[int]], tree: ChoiceTree) -> Packed:
    """Lay out the tails, each of one token or more, followed by the tree's nodes."""
    size = sum(len(tail) + len(tree.nodes) - 1 for tail in tails)
    ids = np.zeros(size, np.int64)
    steps = np.zeros(size, np.int64)
    sees = np.eye(size, dtype=bool)
    rows = np.zeros((len(tails), len(tree.nodes)), np.int64)
    start = 0
    for tail, row in zip(tails, rows, strict=True):
        end = start + len(tail)
        ids[start:end], steps[start:end] = tail, np.arange(len(tail))
        sees[start:end, start:end] = np.tri(len(tail), dtype=bool)
        row[0] = end - 1  # the root's next token follows the wording itself
        for node in range(1, len(tree.nodes)):
            here = row[node] = end + node - 1
            above = row[tree.parent(node)]
            ids[here], steps[here] = tree.nodes[node][-1], steps[above] + 1
            sees[here] |= sees[above]  # the parent node, and all that the parent attends to
        start = end + len(tree.nodes) - 1
    return Packed(ids, steps, sees, rows)


def beliefs(tree: ChoiceTree, log_probs: NDArray[np.float32]) -> NDArray[np.float64]:
    """Score every answer: (answers,) float64, summing to at most 1.

    log_probs: (nodes, vocabulary), log-probabilities of the next token after each node.
    """
    scores = np.zeros(tree.answers)
    for text, answer in tree.texts:
        scores[answer] += np.exp(_score(tree, log_probs, text))
    return scores


def _score(tree: ChoiceTree, log_probs: NDArray[np.float32], text: Text) -> float:
    score = sum(
        float(log_probs[tree.nodes.index(text[:place]), token]) for place, token in enumerate(text)
    )
    if text not in tree.nodes:
        return score
    stopped = log_probs[tree.nodes.index(text)].astype(np.float64)
    stopped[_leading_on(tree, text)] = -np.inf
    return score + float(np.logaddexp.reduce(stopped))


def _leading_on(tree: ChoiceTree, text: Text) -> list[int]:
    """List the tokens that make a text a longer beginning of a candidate."""
    place = len(text)
    longer = {
        other[place] for other, _ in tree.texts if len(other) > place and other[:place] == text
    }
    return sorted(longer)


def number_tree(encode: Encode) -> ChoiceTree:
    """Build the tree of all candidate numbers, for any tokenizer. Raises ValueError.

    All other numbers share one more answer after the candidates. Without it "72", from a model that
    answers in Fahrenheit, would be read as the candidate 7 with which it begins, and "100" as 10;
    both would be felt as cold.
    """
    spellings = {str(number): place for place, number in enumerate(CANDIDATES_C.tolist())}
    others = {str(n): len(CANDIDATES_C) for n in (*range(-99, LEAST_C), *range(MOST_C + 1, 200))}
    return choice_tree({**spellings, **others}, encode)


def number_beliefs(tree: ChoiceTree, log_probs: NDArray[np.float32]) -> Beliefs:
    """Score the candidates, (91,), without the belief in other numbers."""
    return beliefs(tree, log_probs)[: len(CANDIDATES_C)]


def spread(wordings: Sequence[Beliefs], seconds: float = 0.0) -> Reading:
    """Average beliefs in CANDIDATES_C, each (91,) summing to at most 1, over the wordings.

    Each wording counts equally, whatever its share. Raises VlmError if most of an answer's
    probability is not on a number.
    """
    shares = [float(wording.sum()) for wording in wordings]
    if not all(share >= LEAST_SHARE for share in shares):
        problem = f"only {min(shares):.2g} of the model's answer is a number"
        raise VlmError(f"{problem}; use a model that is tuned for instructions")
    normal = [wording / share for wording, share in zip(wordings, shares, strict=True)]
    means = [float(wording @ CANDIDATES_C) for wording in normal]
    mixed: Beliefs = np.mean(normal, axis=0)
    tail = (1.0 - COVERAGE) / 2
    value_c = float(np.mean(means))
    return Reading(
        value_c=value_c,
        # A second mode far away may draw the mean outside.
        low_c=min(quantile(mixed, tail), value_c),
        high_c=max(quantile(mixed, 1.0 - tail), value_c),
        prompt_sd_c=float(np.std(means, ddof=1)) if len(means) > 1 else None,
        method="readout",
        seconds=seconds,
        share=float(np.mean(shares)),
    )


def quantile(normal: Beliefs, level: float) -> float:
    """Return the temperature below which `level` (0..1) of beliefs that sum to 1 lies; degC."""
    edges = np.append(CANDIDATES_C - 0.5, MOST_C + 0.5)
    below = np.concatenate([[0.0], np.cumsum(normal)])
    return float(np.interp(level * below[-1], below, edges))
