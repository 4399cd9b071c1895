"""Every picture of README and docs, made by one command (`make pictures`)."""
