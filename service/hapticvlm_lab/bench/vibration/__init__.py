"""What vibration costs and what skin can tell apart of it; a speaker measured."""
