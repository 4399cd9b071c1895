"""Outputs that people own already, each driven through a program of its maker."""
