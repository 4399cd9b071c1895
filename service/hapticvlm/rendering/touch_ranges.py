"""Declares the ranges of the quantities of a touch that a person asks for, and checks them."""

from __future__ import annotations

from types import MappingProxyType

from hapticvlm.errors import UsageError

# The program computes a touch at any of these; whether a device may do so is up to its own limits.
RANGES = MappingProxyType(
    {
        "object_c": (-100.0, 400.0),  # degC
        "ambient_c": (-60.0, 80.0),  # degC
        "skin_c": (10.0, 45.0),  # degC
        "contact_resistance": (0.0, 1.0),  # m2 K/W
        "thickness_m": (1e-6, 10.0),
        "speed_mps": (0.0, 20.0),
        "force_n": (0.0, 100.0),
        "seconds": (0.02, 60.0),
    }
)


def check(**quantities: float | None) -> None:
    """Raise UsageError, which names the quantity and its range, if one is outside; None passes."""
    for name, value in quantities.items():
        low, high = RANGES[name]
        if value is not None and not low <= value <= high:
            raise UsageError(f"{name}: {value} is not within {low:g}..{high:g}; change it")
