"""Pictures of ground: map, slope, soils, 3-D view, profile. numpy and Pillow; only the 3-D view needs VTK."""

from rille.view.terrain_pictures.marks import Mark
from rille.view.terrain_pictures.oblique import draw_oblique
from rille.view.terrain_pictures.profile import draw_profile
from rille.view.terrain_pictures.shade import draw_shade
from rille.view.terrain_pictures.slope import draw_slope
from rille.view.terrain_pictures.soil import draw_soil

__all__ = ["Mark", "draw_oblique", "draw_profile", "draw_shade", "draw_slope", "draw_soil"]
