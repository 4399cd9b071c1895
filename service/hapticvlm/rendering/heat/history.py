"""Computes what earlier contacts left in the skin, and how it fades under the next contact. Pure.

A contact leaves heat (or cold) in the depth of the skin, which the surface shows until it has
spread. Heat flow q(t) into skin of effusivity es raises its surface by q / es convolved with
1 / sqrt(pi t). A convolution would need the whole past, so the kernel is written as a sum of
exponentials: 1 / sqrt(pi t) is the integral of sqrt(l) exp(-l t) / pi over ln l, and a sum over
RATES, evenly spaced in ln l, gives it within 0.4 % from 0.1 ms to 10 s and within 1 % up to 100 s.
The past is then one height in degC for each rate, however many contacts it had, and each height
decays by exp(-l t) while nothing is touched.

Under a contact the past fades differently, since the object takes part of what is left. In the
Laplace domain an object with

    X(s) = 1 / (1 + R'' es sqrt(s) + es / eo coth(L sqrt(s / a)))      (no thickness: coth = 1)

takes the share X of whatever the surface would do without it. So a past P(s) = sum h / (s + l)
fades as (1 - X) P, and a contact with the contrast G adds sqrt(s) X (G / s - P) / (s + l) to the
height of rate l. Both are transformed back to time by a sum over four points of a contour around
the negative axis (Trefethen, Weideman and Schmelzer 2006; docs/physics.md 1.4), which is exact to
5e-5 in the tests. The fading is tabulated when a contact begins, and after that only looked up.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from hapticvlm.rendering.heat.contact import SKIN, ThermalContact

Past = tuple[float, ...]  # height in degC for each of RATES; () for skin that nothing touched
Fading = tuple[float, ...]  # degC at the times of the table; () for none

RATES = np.geomspace(1e-6, 1e5, 20)  # 1/s
_SPACING = math.log(RATES[1] / RATES[0])
_WEIGHTS = _SPACING / np.pi * np.sqrt(RATES)
# The times of the table are evenly spaced in log(t + _SOONEST_S).
_SOONEST_S = 1e-3
_LATEST_S = 1e4
_NODES = 32
_PITCH = math.log(_LATEST_S / _SOONEST_S) / (_NODES - 1)
_POINTS = 8  # of the contour; half of them are the conjugates of the others
_NO_CONTACT = 1e9  # m2 K/W; from here on no heat flows
_THINNEST = 1e-300  # keeps a vanishing thickness from dividing by zero

Complexes = NDArray[np.complex128]


def remaining_c(past: Past, elapsed_s: float) -> float:
    """Change in degC that untouched skin still shows `elapsed_s` after its past was `past`."""
    if not past:
        return 0.0
    return float(np.exp(-RATES * max(elapsed_s, 0.0)) @ past)


def aged(past: Past, elapsed_s: float) -> Past:
    """Return the past after `elapsed_s` in which nothing was touched."""
    if not past or not elapsed_s > 0.0:
        return past
    return tuple((np.exp(-RATES * elapsed_s) * past).tolist())


def fading(past: Past, contact: ThermalContact) -> Fading:
    """Tabulate the fading of a past under a contact that begins now; look it up by `faded_c`."""
    if not past:
        return ()
    heights = np.array(past)
    later = (
        (1.0 - _transfer(contact, _TABLE_ROOTS)) * (_TABLE_PARTS @ heights) * _TABLE_WEIGHTS
    ).real
    # At the very first moment a contact resistance lets no heat through, so the past is still
    # whole. Without one the surface jumps at once to what the two effusivities leave of it.
    first = sum(past)
    if contact.contact_resistance <= 0.0:
        first *= SKIN.effusivity / (SKIN.effusivity + contact.thermal.effusivity)
    return (first, *later.sum(axis=1).tolist(), 0.0)


def faded_c(table: Fading, elapsed_s: float) -> float:
    """Change in degC that is left of the past `elapsed_s` after the contact began."""
    if not table:
        return 0.0
    if not elapsed_s > 0.0:
        return table[0]
    place = math.log(elapsed_s / _SOONEST_S + 1.0) / _PITCH
    if not place < _NODES:
        return 0.0
    node = int(place)
    return table[node] + (place - node) * (table[node + 1] - table[node])


def after(past: Past, contact: ThermalContact, lasted_s: float, change_c: float) -> Past:
    """Return the past of skin after a contact of `lasted_s` that began on `past`.

    `change_c` is the change of the surface at its end, degC. The sum over the rates misses it by a
    little; the height with the fastest rate takes up the difference, so that the surface does not
    jump.
    """
    heights = np.array(past) if past else np.zeros(RATES.size)
    # For each rate l: the heat flow into the skin during the contact, in the Laplace domain,
    # divided by s + l, is what is left at the end of it at that rate. The sum over the contour
    # evaluates all rates with the same few points.
    s = _CONTOUR / lasted_s
    roots = np.sqrt(s)
    parts = 1.0 / (s[:, None] + RATES)
    driven = (contact.surface_c - contact.skin_c) / s - parts @ heights
    flow = driven * _transfer(contact, roots) * roots * (_CONTOUR_WEIGHTS / lasted_s)
    heights = heights * np.exp(-RATES * lasted_s) + _WEIGHTS * (flow @ parts).real
    heights[-1] += change_c - heights.sum()
    return tuple(heights.tolist())


def flow_w_per_m2(past: Past, contact: ThermalContact, elapsed_s: float) -> float:
    """Heat flow into the skin `elapsed_s` after a contact began on `past`, W/m2.

    It is negative for something cold. In the Laplace domain it is es sqrt(s) X (G / s - P), with
    the terms above.
    """
    if contact.contact_resistance >= _NO_CONTACT:
        return 0.0
    s = _CONTOUR / max(elapsed_s, _SOONEST_S)
    roots = np.sqrt(s)
    driven = (contact.surface_c - contact.skin_c) / s
    if past:
        driven = driven - (1.0 / (s[:, None] + RATES)) @ np.array(past)
    flow = driven * _transfer(contact, roots) * roots * s / _CONTOUR * _CONTOUR_WEIGHTS
    total = SKIN.effusivity * float(flow.sum().real)
    return total if math.isfinite(total) else 0.0


def _transfer(contact: ThermalContact, roots: Complexes) -> Complexes:
    """X(s) above, at these square roots of s, any shape."""
    bulk = contact.thermal
    contrast = np.asarray(SKIN.effusivity / bulk.effusivity, dtype=np.complex128)
    if contact.thickness_m is not None:
        depth_s = (
            max(contact.thickness_m, 0.0) * bulk.density * bulk.heat_capacity / bulk.effusivity
        )
        contrast = contrast / (np.tanh(depth_s * roots) + _THINNEST)
    barrier = min(max(contact.contact_resistance, 0.0), _NO_CONTACT) * SKIN.effusivity
    return np.asarray(1.0 / (1.0 + contrast + barrier * roots))


def _contour(points: int) -> tuple[Complexes, Complexes]:
    """Return points z and weights w, (points / 2,): f(t) is the real part of sum w F(z / t) / t."""
    angle = np.pi * (2.0 * np.arange(points // 2) + 1.0) / points
    bent = 0.6407 * angle
    z = points * (0.5017 * angle / np.tan(bent) - 0.6122 + 0.2645j * angle)
    slope = 0.5017 / np.tan(bent) - 0.5017 * bent / np.sin(bent) ** 2 + 0.2645j
    return z, -2j * np.exp(z) * slope


_CONTOUR, _CONTOUR_WEIGHTS = _contour(_POINTS)
_TABLE_S = _SOONEST_S * np.expm1(_PITCH * np.arange(1.0, _NODES))[:, None]
_TABLE_ROOTS = np.sqrt(_CONTOUR / _TABLE_S)
_TABLE_WEIGHTS = _CONTOUR_WEIGHTS / _TABLE_S
_TABLE_PARTS = 1.0 / ((_CONTOUR / _TABLE_S)[:, :, None] + RATES)
