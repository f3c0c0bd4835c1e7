"""Own landforms: from a TOML profile, a height map, or a solid seen from above; kept as folders that can be shared."""

from rille.terrain.own.heightmap import Georeference, read_height_map
from rille.terrain.own.keeping import Kept, keep_heights, keep_profile, own_folder, remove
from rille.terrain.own.mesh_file import MESH_SUFFIXES, read_triangles, up_axis
from rille.terrain.own.reading import read_own
from rille.terrain.own.solid import heights_of_solid

__all__ = [
    "MESH_SUFFIXES",
    "Georeference",
    "Kept",
    "heights_of_solid",
    "keep_heights",
    "keep_profile",
    "own_folder",
    "read_height_map",
    "read_own",
    "read_triangles",
    "remove",
    "up_axis",
]
