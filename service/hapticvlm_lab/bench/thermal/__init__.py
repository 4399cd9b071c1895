"""Ways to compute what skin feels, side by side: their cost, their error, where they break."""
