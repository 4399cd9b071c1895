"""The command line: a room or a module for each command; `main` collects them."""
