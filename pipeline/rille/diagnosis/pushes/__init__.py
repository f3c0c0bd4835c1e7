"""Short pushes, told from the model's own errors by recordings in which nothing pushed."""
