"""Populations: many landforms of one kind, drawn from a size-frequency law."""

from rille.terrain.population.collide import collision_bodies
from rille.terrain.population.density import Frame
from rille.terrain.population.draw import draw
from rille.terrain.population.laws import LAWS, Law, make_law
from rille.terrain.population.sheet import PopulationSheet

__all__ = ["LAWS", "Frame", "Law", "PopulationSheet", "collision_bodies", "draw", "make_law"]
