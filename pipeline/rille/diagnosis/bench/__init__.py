"""The same for bench recordings: points instead of samples, soil parameters that are fitted along."""
