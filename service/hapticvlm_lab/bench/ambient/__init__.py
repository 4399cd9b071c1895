"""How well the ambient temperature is judged, at what cost."""
