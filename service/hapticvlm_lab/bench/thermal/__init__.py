"""Methods to compute skin temperature, side by side: their cost, their error, where they break."""
