"""The guards of the plate: `hapticvlm chart safety`."""
