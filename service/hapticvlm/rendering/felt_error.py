"""Chooses the one material to render where the material is uncertain, by the expected error. Pure.

A palm that touches an object of uncertain material is given one material of the table, in full. It
is the one that errs least on average: with the belief p_k in each material k, rendering m has the
expected error

    E(m) = sum_k p_k d(m, k),   d(m, k) = vibration in dB / 3 + contact temperature in degC / 1.5.

Two materials that feel alike, such as wood and leather, hardly err in place of each other. Metal in
place of wood errs by 6 degC and 10 dB, so metal needs more belief than wood does. The alternatives
are worse for a palm (`hapticvlm chart whole`): the most probable material errs more often by much,
and a mean of several materials (expectation.py) is none that a person could name.

d is a distance: equal both ways and never shortened by a third material. So a material m with half
of all belief or more is always the choice. For any other n, d(n, k) >= d(m, k) - d(n, m), hence
E(n) - E(m) >= d(n, m) (2 p_m - sum_k p_k) >= 0. A material that is named is therefore the one that
is felt.

Heat is compared for objects at ROOM_C, whatever the object's temperature is: the choice then does
not change with the weather. A material that a user derived from a class vibrates like its class
here, because its own difference is small beside that of two classes.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hapticvlm.materials import MATERIALS, Material, Thermal
from hapticvlm.rendering.heat.contact import contact_temperature_c, thermal_contact

# All figures are our choice (docs/physics.md 4.5), but for the table of differences, which is
# computed (`python -m hapticvlm_lab.bench.vibration.differences`).
VIBRATION_STEP_DB = 3.0  # this difference of vibration counts as much as
HEAT_STEP_C = 1.5  # this difference of the contact temperature
LEAST_BELIEF = 0.05  # in a material that may be rendered: nobody believes in the others
LEAD = 0.15  # of belief that another material needs over the one that is felt already
DOUBTFUL = 0.5  # belief in the rendered material below which its impact is weaker
DOUBTFUL_IMPACT = 0.7  # gain of that impact: a false strike startles
ROOM_C = 22.0  # of the objects whose heat is compared: the default of the ambient

Doubles = NDArray[np.float64]


def least_felt_error(
    beliefs: Mapping[str, float], table: Mapping[str, Material], felt: str | None = None
) -> str:
    """Return the name of the believed material of least expected error.

    `beliefs` are probabilities by material name, at least one above 0; they need not sum to 1.
    `felt` is the material that the object has been felt as: it is kept until another one is better
    by as much as a lead of LEAD in belief would make it.
    """
    names = sorted(name for name, belief in beliefs.items() if belief > 0.0)
    differences = felt_differences([table[name] for name in names])
    shares = np.array([beliefs[name] for name in names])
    errors = differences @ shares
    may_be_felt = shares >= min(LEAST_BELIEF, shares.max())
    best = int(np.where(may_be_felt, errors, np.inf).argmin())
    if felt not in names:
        return names[best]
    held = names.index(felt)
    # For two materials alone, E(held) - E(best) = (p_best - p_held) d(held, best): the condition is
    # then that the better one leads by LEAD, as for a name (evidence/ladder.py).
    is_worse = errors[held] - errors[best] > LEAD * differences[held, best]
    return names[best] if is_worse or not may_be_felt[held] else names[held]


def felt_differences(table: Sequence[Material]) -> Doubles:
    """Return the felt difference of each two of M materials, (M, M): d at the head of the file."""
    contact_c = np.array([_contact_c(each.thermal) for each in table])
    rows = [_ROWS[each.like or each.name] for each in table]
    vibration_db = _VIBRATION_DB[np.ix_(rows, rows)]
    heat_c = np.abs(contact_c[:, None] - contact_c[None, :])
    return np.asarray(vibration_db / VIBRATION_STEP_DB + heat_c / HEAT_STEP_C)


@lru_cache(maxsize=256)
def _contact_c(thermal: Thermal) -> float:
    return contact_temperature_c(thermal_contact(thermal, ROOM_C))


def _read_differences() -> Doubles:
    path = Path(__file__).parent / "vibration" / "differences.toml"
    differences = np.zeros((len(MATERIALS), len(MATERIALS)))
    for one, others in tomllib.loads(path.read_text(encoding="utf-8")).items():
        for other, db in others.items():
            differences[_ROWS[one], _ROWS[other]] = differences[_ROWS[other], _ROWS[one]] = db
    return differences


_ROWS = {name: row for row, name in enumerate(MATERIALS)}
_VIBRATION_DB = _read_differences()
