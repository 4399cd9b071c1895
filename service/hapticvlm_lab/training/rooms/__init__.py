"""Rooms of things of known materials, drawn by three.js in a headless Chromium, to train on."""

from hapticvlm_lab.training.rooms.page import Picture, Rooms, RoomsError, opened

__all__ = ["Picture", "Rooms", "RoomsError", "opened"]
