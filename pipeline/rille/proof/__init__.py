"""Sealed trials: recordings from an independent generator in which something is concealed, answers, seals, scores."""
