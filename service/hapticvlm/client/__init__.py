"""The Python client of HapticVLM, used by researchers and by the package's own tools."""

from hapticvlm.client.connection import Client, Refused, TouchEnded, connect, trusting

__all__ = ["Client", "Refused", "TouchEnded", "connect", "trusting"]
