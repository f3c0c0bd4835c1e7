"""A recording beside the model: what is left over, and what its statistics say."""
