"""Terrain and soil as values. Heights are points: n values bound n-1 cells; row 0 is the northernmost."""

from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from rille.model.rover import Material, Pose, Provenance, SourceFile


@dataclass(frozen=True, slots=True, kw_only=True)
class Soil:
    """Soil of the Bekker / Wong-Reece family of wheel-soil models.

    sinkage_exponent : n [-]. cohesive_modulus : kc [N/m^(n+1)]. frictional_modulus : kphi [N/m^(n+2)].
    cohesion : c [Pa]. friction_angle : phi [rad]. shear_modulus : K [m]. lateral_shear_modulus : ky [m].
    peak_angle_offset, peak_angle_slip : a0, a1 [-] in theta_m = (a0 + a1 s) theta_f.
    exit_sinkage_ratio : lambda [-] in theta_r = -acos(1 - lambda z / r). density : [kg/m^3].
    damping : pressure per speed of penetration [Pa s/m].
    reece_cohesive_modulus, reece_frictional_modulus : kc', kphi' [-]; None: kc and kphi read at the wheel's width.
    """

    name: str
    sinkage_exponent: float
    cohesive_modulus: float
    frictional_modulus: float
    cohesion: float
    friction_angle: float
    shear_modulus: float
    lateral_shear_modulus: float
    density: float
    peak_angle_offset: float = 0.4
    peak_angle_slip: float = 0.15
    exit_sinkage_ratio: float = 0.0
    damping: float = 3.0e4
    reece_cohesive_modulus: float | None = None
    reece_frictional_modulus: float | None = None
    provenance: Provenance = "stated"
    source: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class MaterialPair:
    """Response of a pair: a wheel's material (None: any) on a soil, or two rigid materials (None: any).

    ``rigid`` with a soil: wheels meet that ground as if it were rock. friction, restitution : of rigid pairs [-].
    """

    response: Literal["rigid", "bekker", "bekker_wong", "reece"]
    material: str | None = None
    other_material: str | None = None
    soil: str | None = None
    friction: float | None = None
    restitution: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class SoilPatch:
    """Region with its own soil. polygon : corners [m] in W, shape (n >= 3, 2); later patches lie on earlier ones."""

    name: str
    soil: str
    polygon: tuple[tuple[float, float], ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class LandformInstance:
    """A registered landform placed at (x, y) [m] in W, turned by ``heading`` [rad] and enlarged ``scale`` times in all directions.

    drivers : in SI by name. soil : of its surface; empty: that of the ground. age : the older lie below the younger; None: youngest.
    """

    name: str
    landform: str
    x: float
    y: float
    heading: float = 0.0
    scale: float = 1.0
    drivers: dict[str, float] = field(default_factory=dict)
    soil: str = ""
    age: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Population:
    """Many landforms of one kind, drawn from a law. x, y [m] in W, heading [rad]: each (n,); drivers: name -> (n,), SI.

    scale : all of them enlarged so many times.
    law : what was asked for, in words and numbers, for the record (JSON-able). Those of higher index lie on those of lower.
    """

    name: str
    landform: str
    x: NDArray[np.float64]
    y: NDArray[np.float64]
    heading: NDArray[np.float64]
    drivers: dict[str, NDArray[np.float64]]
    scale: float = 1.0
    law: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class Obstacle:
    """A rock or block that does not move. pose : of its centre in W; a cylinder's axis is its z.

    size : box: full lengths [m]; sphere: (radius,); cylinder: (radius, height). vertices : hull, shape (n >= 4, 3) [m] from the centre.
    """

    name: str
    kind: Literal["box", "sphere", "cylinder", "hull"]
    pose: Pose
    size: tuple[float, ...] = ()
    vertices: NDArray[np.float64] | None = None
    material: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Terrain:
    """A digital elevation model with soil, in the local frame W (x east, y north, z up).

    heights : [m], float64, shape (n_rows, n_cols), row 0 north; the value of row i, column j stands at
    x = x_west + j posting_x, y = y_north - i posting_y. NaN = no value.
    map_origin : easting, northing, height [m] of the origin of W in ``crs``. map_heading : turn of W's x against east [rad], so that
    (E, N) = map_origin + R(map_heading) (x, y).
    filled : True where the base had no height and one was interpolated, shape of heights; None: nowhere.
    """

    name: str
    heights: NDArray[np.float64]
    posting_x: float
    posting_y: float
    x_west: float
    y_north: float
    soil: str
    soils: tuple[Soil, ...]
    pairs: tuple[MaterialPair, ...]
    patches: tuple[SoilPatch, ...] = ()
    landforms: tuple[LandformInstance, ...] = ()
    populations: tuple[Population, ...] = ()
    obstacles: tuple[Obstacle, ...] = ()
    materials: tuple[Material, ...] = ()
    crs: str = ""
    map_origin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    map_heading: float = 0.0
    filled: NDArray[np.bool_] | None = None
    source: str = ""
    sources: tuple[SourceFile, ...] = ()
