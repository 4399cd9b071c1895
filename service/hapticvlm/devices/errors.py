"""Declares the one error that all hardware failures are reported as."""

from __future__ import annotations

from hapticvlm.errors import HapticVLMError


class DeviceError(HapticVLMError):
    """The hardware failed or is missing; outputs rest and the scene is notified."""
