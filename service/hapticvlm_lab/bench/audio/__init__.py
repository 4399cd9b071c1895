"""Contact to the first sample at a recorded sink, beside a bare audio program."""
