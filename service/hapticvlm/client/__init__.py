"""The Python client of HapticVLM, used by researchers and by the package's own tools."""

from hapticvlm.client.connection import Client, Refused, connect, trusting

__all__ = ["Client", "Refused", "connect", "trusting"]
