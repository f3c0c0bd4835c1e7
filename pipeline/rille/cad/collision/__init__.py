"""Convex shapes for collisions, and the symmetry that makes them exact for wheels."""
