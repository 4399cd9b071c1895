"""The edge of the network: sockets, their budgets, and what arrives whole."""
