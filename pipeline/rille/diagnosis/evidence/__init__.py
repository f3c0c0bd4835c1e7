"""What recordings say about settings: residuals of windows, replayed from starts that were fitted once."""
