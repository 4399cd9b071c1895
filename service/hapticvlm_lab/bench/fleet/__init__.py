"""One shared recogniser asked by many simulated scenes."""
