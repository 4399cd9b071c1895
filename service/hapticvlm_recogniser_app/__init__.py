"""The recogniser for many services: one encoder behind HTTP, run by Ray Serve (extra `ray`)."""
