"""What goes wrong with hardware, as one kind of error."""

from __future__ import annotations

from hapticvlm.errors import HapticVLMError


class DeviceError(HapticVLMError):
    """The hardware failed or is not there; outputs rest and the scene is notified."""
