"""Touches that are computed without scene or service."""

GLOVE = "weart"
OWNED = ("quest", "pad", "phone", "intiface", GLOVE)  # outputs that owned.py renders
