"""The forced-choice study of what people feel, its statistics, and the machine observer."""
