"""Tests that readers who are colour-blind can distinguish the colours of every figure."""

import itertools

import numpy as np
import pytest

from hapticvlm_lab.bench.material import chart, stability

# Of red, green and blue in linear light, without the green-sensitive cones
# (Machado and others, IEEE TVCG 15(6), 2009, severity 1).
DEUTERANOPIA = np.array(
    [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.01182, 0.04294, 0.968881]]
)
TO_XYZ = np.array(
    [
        [0.4124564, 0.3575761, 0.1804375],
        [0.2126729, 0.7151522, 0.072175],
        [0.0193339, 0.119192, 0.9503041],
    ]
)
WHITE = np.array([0.95047, 1.0, 1.08883])
APART = 10.0  # CIE 1976: several times what is just told apart side by side
FIGURES = {
    "chart material": [colour for colour, _ in chart.STYLE.values()],
    "stability material": [curve[2] for curve in stability.LINES],
}


def linear(colour: str) -> np.ndarray:
    """Red, green and blue of a colour in linear light, 0 to 1."""
    coded = np.array([int(colour[at : at + 2], 16) for at in (1, 3, 5)]) / 255
    return np.where(coded <= 0.04045, coded / 12.92, ((coded + 0.055) / 1.055) ** 2.4)


def lab(light: np.ndarray) -> np.ndarray:
    """CIE 1976 L*, a*, b* of linear light."""
    x, y, z = np.cbrt(TO_XYZ @ np.clip(light, 0, 1) / WHITE)
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


def apart(first: str, second: str) -> float:
    """Distance of two colours for a reader without green-sensitive cones."""
    seen = [lab(DEUTERANOPIA @ linear(colour)) for colour in (first, second)]
    return float(np.linalg.norm(seen[0] - seen[1]))


@pytest.mark.parametrize("figure", FIGURES)
def test_no_two_colours_of_a_figure_look_alike_to_a_colour_blind_reader(figure: str) -> None:
    colours = sorted(set(FIGURES[figure]))

    assert len(colours) >= 3
    pairs = {pair: apart(*pair) for pair in itertools.combinations(colours, 2)}
    assert {pair: far for pair, far in pairs.items() if far < APART} == {}


def test_red_and_green_of_equal_light_would_look_alike() -> None:
    assert apart("#a04040", "#646e40") < APART
