"""Making the shipped encoders; nothing of it is imported at run time."""
