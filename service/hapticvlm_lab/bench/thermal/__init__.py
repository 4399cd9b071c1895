"""The course of skin temperature: how exact the product is, and against which yardstick."""
