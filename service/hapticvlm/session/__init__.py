"""One scene's state, sans I/O: a message and the time go in, actions come out."""
