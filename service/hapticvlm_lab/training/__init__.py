"""Training of the shipped encoders; the product imports nothing of it at run time."""
