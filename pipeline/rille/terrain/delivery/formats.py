"""The formats that a terrain is delivered in, found by name or by the ending of a file."""

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path

from rille.model import InputRefused, Terrain, nearest_names
from rille.terrain.delivery.strips import Progress


@dataclass(frozen=True, slots=True, kw_only=True)
class Format:
    """A way to deliver a terrain. endings : of file names, the first one is usual. beside : names of files that come with it.
    obstacles : it holds those that the scene states.
    """

    name: str
    endings: tuple[str, ...]
    meaning: str
    beside: tuple[str, ...] = ()
    module: str = ""
    obstacles: bool = False

    def write(self, terrain: Terrain, path: Path, progress: Progress | None = None) -> list[Path]:
        """Write the terrain; ``path`` and what comes with it appear complete or not at all. Returns all files that were written.

        Raises
        ------
        InputRefused : for what the format cannot express, or a file that cannot be written.
        """
        writer: Callable[[Terrain, Path, Progress | None], list[Path] | None]
        writer = import_module(f"rille.terrain.delivery.{self.module or self.name}").write
        more = writer(terrain, Path(path), progress) or []
        return [*(file for file in self.files(path) if file.exists()), *more]

    def files(self, path: Path) -> list[Path]:
        """Every file that it writes for a path, but for those of which there are as many as obstacles."""
        path = Path(path)
        return [path, *(Path(path.parent, ending.format(name=path.name, stem=path.stem)) for ending in self.beside)]


FORMATS = {
    entry.name: entry
    for entry in (
        Format(name="geotiff", endings=(".tif", ".tiff"), meaning="GeoTIFF, float64 map heights, turned where the terrain is"),
        Format(name="cog", endings=(".cog.tif", ".cog"), meaning="cloud-optimised GeoTIFF with overviews"),
        Format(
            name="ascii",
            module="ascii_grid",
            endings=(".asc",),
            beside=("{stem}.prj",),
            meaning="ESRI ASCII grid, all digits; square cells only",
        ),
        Format(name="pds4", endings=(".xml", ".lblx"), beside=("{stem}.img",), meaning="PDS4 label and image; needs a projection"),
        Format(name="png16", endings=(".png",), beside=("{name}.json",), meaning="16-bit PNG with scale and offset in a JSON sidecar"),
        Format(name="npy", endings=(".npy",), beside=("{name}.json",), meaning="numpy array of float64 with a JSON sidecar"),
        Format(name="obj", endings=(".obj",), meaning="OBJ mesh, text, all digits", obstacles=True),
        Format(name="stl", endings=(".stl",), meaning="binary STL mesh, single precision"),
        Format(
            name="glb",
            module="gltf",
            endings=(".glb",),
            meaning="glTF 2.0 mesh in one file, y up, single precision around its middle",
            obstacles=True,
        ),
        Format(name="gltf", endings=(".gltf",), beside=("{stem}.bin",), meaning="the same as JSON with a .bin beside", obstacles=True),
        Format(
            name="mujoco",
            endings=(".mjcf",),
            beside=("{stem}.bin",),
            meaning="MuJoCo height field with an MJCF that places it",
            obstacles=True,
        ),
        Format(
            name="gazebo",
            endings=(".sdf", ".world"),
            beside=("{stem}.png",),
            meaning="Gazebo world with a 16-bit heightmap; 2^n + 1 points",
            obstacles=True,
        ),
        Format(
            name="soil",
            module="soil_map",
            endings=(".soil.tif",),
            beside=("{name}.aux.xml",),
            meaning="soil map, GeoTIFF of uint8 with names",
        ),
    )
}


def find_format(path: Path, name: str | None = None) -> Format:
    """The format of that name, or else that of the longest ending of the file's name.

    Raises
    ------
    InputRefused : if there is none, with the nearest names.
    """
    if name is not None:
        if name.lower() not in FORMATS:
            raise InputRefused(f"there is no format '{name}'; {nearest_names(name, FORMATS)}")
        return FORMATS[name.lower()]
    text = Path(path).name.lower()
    matching = [(len(ending), entry) for entry in FORMATS.values() for ending in entry.endings if text.endswith(ending)]
    if not matching:
        endings = [ending for entry in FORMATS.values() for ending in entry.endings]
        last = "".join(Path(text).suffixes[-1:])
        hint = nearest_names(last, [*endings, ".db"]) if last else f"known endings: {', '.join([*endings, '.db'])}"
        raise InputRefused(f"the format of '{path}' cannot be told from its ending, and no --format names it; {hint}")
    return max(matching, key=lambda pair: pair[0])[1]
