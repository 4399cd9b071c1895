"""Whole pipelines, from the evidence on an object to the touch of a palm."""
