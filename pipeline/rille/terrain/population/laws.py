"""Size-frequency laws: N(>= D) per m^2 of craters and rocks, D [m]."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rille.model import InputRefused, nearest_names
from rille.model.quantity import to_si
from rille.terrain.population.chronology import exposure_age, production, wear

Array = NDArray[np.float64]
Number = Callable[[Array], Array]

VIPER = "VIPER Environmental Specification VIPER-MSE-SPEC-001 (2021), as in NASA synthterrain"
SYNTHETIC_MOON = "NASA synthetic_moon, as in NASA synthterrain (no further source given there)"
NEUKUM = "G. Neukum, B. A. Ivanov & W. K. Hartmann 2001, Space Sci. Rev. 96, table II and eq. 5"


@dataclass(frozen=True, slots=True, kw_only=True)
class Law:
    """A size-frequency law.

    number : D [m] (n,) -> N(>= D) [1/m^2], falling. valid : diameters [m] for which it is used without remark: those of its source where
    it states any (Neukum: 10 m to 300 km), else rille's judgement. parameters : in SI, for the record. surface_age : [s], None where the
    law knows no time.
    """

    name: str
    of: str
    number: Number
    valid: tuple[float, float]
    source: str
    parameters: dict[str, float | str] = field(default_factory=dict)
    surface_age: float | None = None

    def exposure(self, diameter: Array, u: Array) -> tuple[Array, Array]:
        """Age [s] and wear [-] of craters; u uniform in [0, 1): the share of their time that has passed.

        Where the surface is older than craters of that size live (steady state), their ages fill their lifetime only; see
        :func:`rille.terrain.population.chronology.exposure_age`. Only for laws with a surface age.
        """
        assert self.surface_age is not None
        return exposure_age(self.number, diameter, u, self.surface_age), wear(self.number, diameter, u, self.surface_age, trask)


def power_law(coefficient: float, exponent: float) -> Number:
    """N = coefficient D^-exponent."""
    return lambda d: coefficient * np.asarray(d, np.float64) ** -exponent


trask = power_law(10**-1.1, 2.0)
hartmann = power_law(10**-1.14 * 1e-6 * 1000**1.83, 1.83)


def viper_craters(d: Array) -> Array:
    """N = 29174 D^-1.92 per km^2 up to 80 m, 156228 D^-2.389 beyond (VIPER-MSE-SPEC-001).

    The published pieces do not meet: 6.47 and 4.44 per km^2 at 80 m. Taken literally, a third of all craters beyond 80 m would be
    80 m wide; a power law from the first at 80 m to the second at 100 m joins them instead.
    """
    d = np.asarray(d, np.float64)
    low, high = 29174e-6 * d**-1.92, 156228e-6 * d**-2.389
    first, second = 29174e-6 * 80.0**-1.92, 156228e-6 * 100.0**-2.389
    between = first * (d / 80.0) ** (np.log(second / first) / np.log(100.0 / 80.0))
    return np.select([d <= 80.0, d <= 100.0], [low, between], high)


def golombek(k: float) -> Number:
    """Rocks that cover the share F(>= D) = k exp(-q D) of the ground, q = 1.79 + 0.152 / k (Golombek & Rapp 1997 eq. 1, 3).

    A rock covers pi D^2 / 4, so dN = -dF / (pi D^2 / 4), and with the exponential integral E1
    N(>= D) = 4 k q / pi (exp(-q D) / D - q E1(q D)).
    """
    q = 1.79 + 0.152 / k

    def number(d: Array) -> Array:
        from scipy.special import exp1

        d = np.asarray(d, np.float64)
        return 4 * k * q / np.pi * (np.exp(-q * d) / d - q * exp1(q * d))

    return number


def _fixed(name: str, of: str, number: Number, valid: tuple[float, float], source: str) -> Callable[[dict[str, Any], str], Law]:
    return lambda given, subject: Law(name=name, of=of, number=number, valid=valid, source=source)


def _neukum(given: dict[str, Any], subject: str) -> Law:
    age = _age(given, subject)
    return Law(
        name="neukum",
        of="craters",
        number=lambda d: production(d, age),
        valid=(10.0, 300e3),
        source=NEUKUM,
        parameters={"surface_age": age},
        surface_age=age,
    )


def _production_or_equilibrium(given: dict[str, Any], subject: str) -> Law:
    age = _age(given, subject)
    name = given.get("equilibrium", "trask")
    if name not in ("trask", "hartmann", "viper"):
        raise InputRefused(f"the equilibrium of {subject} is '{name}'; it must be 'trask', 'hartmann' or 'viper'")
    equilibrium = {"trask": trask, "hartmann": hartmann, "viper": viper_craters}[name]
    return Law(
        name="production_or_equilibrium",
        of="craters",
        number=lambda d: np.minimum(production(d, age), equilibrium(d)),
        valid=(0.1 if name == "trask" else 1.0, 300e3),
        source=f"the smaller of production ({NEUKUM}) and equilibrium ('{name}')",
        parameters={"surface_age": age, "equilibrium": name},
        surface_age=age,
    )


def _golombek(given: dict[str, Any], subject: str) -> Law:
    k = _number(given, "k", "dimensionless", subject)
    if not 0.001 <= k <= 0.6:
        raise InputRefused(f"k of {subject} is {k:g}; it must lie between 0.001 and 0.6, the share of ground that rocks cover")
    return Law(
        name="golombek",
        of="rocks",
        number=golombek(k),
        valid=(0.02, 10.0),
        source="M. P. Golombek & D. Rapp 1997, J. Geophys. Res. 102, 4117, eq. 1 and 3",
        parameters={"k": k},
    )


def _power(given: dict[str, Any], subject: str) -> Law:
    coefficient, exponent = (_number(given, key, "dimensionless", subject) for key in ("coefficient", "exponent"))
    if coefficient <= 0 or exponent <= 0:
        raise InputRefused(
            f"the power law of {subject} has coefficient {coefficient:g} and exponent {exponent:g}; both must be above 0 in "
            "N(>= D) = coefficient D^-exponent per m^2"
        )
    return Law(
        name="power",
        of="landforms",
        number=power_law(coefficient, exponent),
        valid=(0.0, np.inf),
        source="stated in the scene",
        parameters={"coefficient": coefficient, "exponent": exponent},
    )


# name -> (parameters that it must be given, those that it may be given, maker)
LAWS: dict[str, tuple[tuple[str, ...], tuple[str, ...], Callable[[dict[str, Any], str], Law]]] = {
    "trask": ((), (), _fixed("trask", "craters", trask, (0.1, 300.0), "N. J. Trask 1966, JPL Tech. Rep. 32-800: 10^-1.1 D^-2 per m^2")),
    "hartmann": (
        (),
        (),
        _fixed("hartmann", "craters", hartmann, (1.0, 1e5), "W. K. Hartmann 1984, Icarus 60, 56: 10^-1.14 D_km^-1.83 per km^2"),
    ),
    "viper": ((), (), _fixed("viper", "craters", viper_craters, (1.0, 1000.0), VIPER)),
    "neukum": (("surface_age",), (), _neukum),
    "production_or_equilibrium": (("surface_age",), ("equilibrium",), _production_or_equilibrium),
    "golombek": (("k",), (), _golombek),
    "viper_rocks": ((), (), _fixed("viper_rocks", "rocks", power_law(0.0003, 2.482), (0.1, 10.0), VIPER)),
    "haworth": ((), (), _fixed("haworth", "rocks", power_law(0.002, 2.6607), (0.1, 10.0), SYNTHETIC_MOON)),
    "intercrater": ((), (), _fixed("intercrater", "rocks", power_law(1e-4, 1.75457), (0.1, 10.0), SYNTHETIC_MOON)),
    "power": (("coefficient", "exponent"), (), _power),
}


def make_law(name: str, given: Mapping[str, Any], subject: str) -> Law:
    """A law by its name and parameters (numbers in SI or strings with units).

    Raises
    ------
    InputRefused : for an unknown law, a parameter that it does not have or that is missing or out of range.
    """
    if name not in LAWS:
        raise InputRefused(f"{subject} asks for the law '{name}', which rille does not know; {nearest_names(name, LAWS)}")
    needed, optional, maker = LAWS[name]
    for key in given:
        if key not in needed + optional:
            known = nearest_names(key, needed + optional) if needed + optional else "it has none"
            raise InputRefused(f"{subject} sets '{key}', which is no parameter of the law '{name}'; {known}")
    for key in needed:
        if key not in given:
            example = {"surface_age": 'surface_age = "3.5 Gyr"', "k": "k = 0.05"}.get(key, f"{key} = 1.0")
            raise InputRefused(f"{subject} asks for the law '{name}', which needs '{key}', for example {example}")
    return maker(dict(given), subject)


def _number(given: Mapping[str, Any], key: str, unit: str, subject: str) -> float:
    return to_si(given[key], unit, f"{key} of the law of {subject}")


def _age(given: Mapping[str, Any], subject: str) -> float:
    from rille.terrain.population.chronology import GYR

    age = _number(given, "surface_age", "s", subject)
    if not 1e-6 * GYR <= age <= 4.5 * GYR:
        raise InputRefused(
            f'the surface_age of {subject} is {age / GYR:g} Gyr; it must lie between 1e-6 and 4.5 Gyr: write it with its unit, "3.5 Gyr"'
        )
    return age
