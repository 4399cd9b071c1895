"""HapticVLM: virtual objects feel like what they look like."""

__version__ = "0.3.0"
