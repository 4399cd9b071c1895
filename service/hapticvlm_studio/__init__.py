"""Tools to design, calibrate, grade and study touches; built on the service."""
