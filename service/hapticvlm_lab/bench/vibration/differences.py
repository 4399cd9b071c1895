"""Computes the difference that a palm feels between the vibrations of any two materials.

`python -m hapticvlm_lab.bench.vibration.differences` prints the table of the service,
`rendering/vibration/differences.toml`. Both vibrations are rendered as the service does, a strike
and a slide. Their levels in third octaves are added to the absolute threshold of the palm, and the
largest remaining difference counts; that of the slide and that of the strike are averaged.

`spectra.difference_db` also knows what the intended vibration masks. That is left out here, because
it depends on which of the two is the intended one. Without it the difference is a distance: equal
both ways, and never shortened by a third material on the way (rendering/felt_error.py needs this).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hapticvlm.materials import MATERIALS
from hapticvlm.rendering.vibration.impacts import impact
from hapticvlm.rendering.vibration.vibration import Motion
from hapticvlm_lab.bench.vibration.spectra import (
    bands_db,
    event_db,
    model_threshold_db,
    rub,
    steady_db,
)

STRIKE = Motion(1.0, 1.0)
HEADING = """\
# Difference that a palm feels between the vibrations of two materials, dB: the mean of a strike
# and of a slide. Made by `python -m hapticvlm_lab.bench.vibration.differences`; each pair stands
# once.
"""

Doubles = NDArray[np.float64]


def differences_db() -> dict[tuple[str, str], float]:
    """Return the difference of each pair of built-in materials, in their order, dB."""
    names = list(MATERIALS)
    slides = {name: _bands_db(steady_db(rub(name))) for name in names}
    strikes = {
        name: _bands_db(event_db(impact(MATERIALS[name].vibration, "strike", STRIKE, 0)))
        for name in names
    }
    pairs = [(one, other) for at, one in enumerate(names) for other in names[at + 1 :]]
    return {
        (one, other): float(
            np.abs(slides[one] - slides[other]).max() + np.abs(strikes[one] - strikes[other]).max()
        )
        / 2.0
        for one, other in pairs
    }


def table() -> str:
    """Return the text of the service's table."""
    lines = [HEADING]
    rows: dict[str, list[str]] = {}
    for (one, other), db in differences_db().items():
        rows.setdefault(one, []).append(f"{other} = {db:.1f}")
    lines += [f"{one} = {{ {', '.join(cells)} }}\n" for one, cells in rows.items()]
    return "".join(lines)


def _bands_db(spectrum: tuple[Doubles, Doubles]) -> Doubles:
    """Return levels in third octaves, the threshold of the palm included, (18,) dB."""
    hertz, level_db = spectrum
    return bands_db(hertz, level_db, model_threshold_db(np.maximum(hertz, 1.0)))


if __name__ == "__main__":
    print(table(), end="")
