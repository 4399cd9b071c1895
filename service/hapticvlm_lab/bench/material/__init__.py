"""How well materials are recognised, at what cost, and what it takes to break it."""
