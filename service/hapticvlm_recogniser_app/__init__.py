"""A recogniser shared by many services: one encoder behind HTTP, on uvicorn or on Ray Serve."""
