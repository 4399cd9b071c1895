"""Seeded draws: numbers on the host, fields on the device. Knows nothing of pictures.

A sample's parameters are plain floats of one `random.Random`; noise fields come from one
`torch.Generator`. The same seed gives the same draws on the same kind of device; fields differ
between CPU and GPU, whose generators differ.
"""

from __future__ import annotations

import math
import random
from collections.abc import Sequence
from typing import TypeVar

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

Choice = TypeVar("Choice")


class Dice:
    """One seed's stream of draws."""

    def __init__(self, seed: int, device: str = "cpu") -> None:
        self.device = device
        self._host = random.Random(seed)
        self._fields = torch.Generator(device).manual_seed(seed)
        self.numbers = np.random.default_rng(seed)

    def uniform(self, low: float = 0.0, high: float = 1.0) -> float:
        """Return a float in [low, high)."""
        return self._host.uniform(low, high)

    def spread(self, low: float, high: float) -> float:
        """Return a float in [low, high), even on a logarithmic scale; both positive."""
        return math.exp(self._host.uniform(math.log(low), math.log(high)))

    def normal(self, deviation: float = 1.0) -> float:
        """Return a normal float of mean 0."""
        return self._host.gauss(0.0, deviation)

    def chance(self, probability: float) -> bool:
        """Return true with this probability."""
        return self._host.random() < probability

    def integer(self, low: int, high: int) -> int:
        """Return an integer in [low, high], both included."""
        return self._host.randint(low, high)

    def choose(self, choices: Sequence[Choice]) -> Choice:
        """One of the choices, all equally likely."""
        return self._host.choice(choices)

    def weigh(self, choices: Sequence[tuple[Choice, float]]) -> Choice:
        """One of the choices, each as likely as its weight says."""
        weights = [weight for _, weight in choices]
        return self._host.choices([choice for choice, _ in choices], weights)[0]

    def field(self, *shape: int) -> Tensor:
        """Return standard normal noise, float32 on the device."""
        return torch.randn(shape, generator=self._fields, device=self.device)

    def flat(self, *shape: int) -> Tensor:
        """Uniform noise in [0, 1), float32 on the device."""
        return torch.rand(shape, generator=self._fields, device=self.device)

    def directions(self, count: int) -> NDArray[np.float32]:
        """Even directions: (count, 3) float32, unit norm."""
        drawn = self.numbers.normal(size=(count, 3)).astype(np.float32)
        lengths = np.linalg.norm(drawn, axis=1, keepdims=True)
        unit: NDArray[np.float32] = (drawn / np.maximum(lengths, 1e-6)).astype(np.float32)
        return unit
