"""HapticVLM's Python client: what researchers and the package's own tools connect with."""

from hapticvlm.client.connection import Client, Refused, connect, trusting

__all__ = ["Client", "Refused", "connect", "trusting"]
