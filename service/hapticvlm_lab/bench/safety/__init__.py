"""What the guards of the plate are worth: `hapticvlm chart safety`."""
