"""Whole pipelines, from what is known of an object to what a palm feels of it."""
