"""Synthesis of vibration: its cost, and the differences that a palm feels."""
