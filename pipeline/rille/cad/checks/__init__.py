"""Can a model be trusted? Every check says what it compared, with what, and what to do."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rille.cad.checks.body_shape import body_shapes
from rille.cad.checks.finding import CODES, Finding
from rille.cad.checks.interference import InterferenceReport, find_interference
from rille.cad.checks.joints import check_couplings, check_drives, check_joints, check_loops, check_wheels
from rille.cad.checks.linkage import Linkage, Mobility
from rille.cad.checks.mass import check_budget, check_masses
from rille.cad.checks.ranges import check_ranges, describe
from rille.cad.checks.structure import check_contact, check_references, check_tree
from rille.cad.checks.twins import check_twins
from rille.model import Rover
from rille.model.severity import Severity

__all__ = ["CODES", "CheckReport", "Finding", "Severity", "check", "describe", "examine"]

_ORDER = {"error": 0, "warning": 1, "note": 2}


@dataclass(frozen=True, slots=True, kw_only=True)
class CheckReport:
    """Findings (errors first), the freedom of the mechanism and the interference; the latter two None where references are broken."""

    findings: tuple[Finding, ...]
    mobility: Mobility | None
    interference: InterferenceReport | None


def check(
    rover: Rover,
    *,
    mass_budget: float | None = None,
    mass_tolerance: float = 0.01,
    samples: int = 256,
    seed: int = 0,
    time_limit: float = 120.0,
    progress: Callable[[str, float], None] | None = None,
) -> list[Finding]:
    """Everything that is wrong, suspicious or worth knowing about a model, errors first; see :data:`CODES`.

    Parameters
    ----------
    mass_budget : total mass that is wanted [kg]; None: not checked. mass_tolerance : relative.
    samples : combinations of all joints to look for interference in (:func:`rille.cad.checks.interference.find_interference`);
    negative: interference is not looked for.
    seed, time_limit [s], progress : of that search.
    """
    report = examine(
        rover,
        mass_budget=mass_budget,
        mass_tolerance=mass_tolerance,
        samples=samples,
        seed=seed,
        time_limit=time_limit,
        progress=progress,
    )
    return list(report.findings)


def examine(
    rover: Rover,
    *,
    mass_budget: float | None = None,
    mass_tolerance: float = 0.01,
    samples: int = 256,
    seed: int = 0,
    time_limit: float = 120.0,
    progress: Callable[[str, float], None] | None = None,
) -> CheckReport:
    """:func:`check` with what was computed on the way, for pictures and tables."""
    say = progress or (lambda what, fraction: None)
    found = list(check_references(rover))
    if found:
        return CheckReport(findings=tuple(found), mobility=None, interference=None)
    say("mass, centre, inertia", 0.0)
    shapes = body_shapes(rover)
    found += check_tree(rover)
    sound = all(finding.code == "body.unconnected" for finding in found) and all(
        joint.kind not in ("hinge", "prismatic") or np.linalg.norm(joint.axis) > 1e-9 for joint in rover.joints
    )
    found += check_masses(rover, shapes)
    if mass_budget is not None:
        found += check_budget(rover, mass_budget, mass_tolerance)
    say("twins", 0.02)
    if all(np.isfinite(body.properties.com).all() and np.isfinite(body.properties.inertia).all() for body in rover.bodies):
        found += check_twins(rover, shapes)
    say("contact of parts", 0.04)
    found += check_contact(shapes)
    say("joints", 0.1)
    found += check_joints(rover, shapes)
    found += check_couplings(rover)
    mobility = interference = None
    if sound:
        found += check_loops(rover, shapes)
        found += check_wheels(rover, shapes)
        found += check_drives(rover)
        mobility = Linkage(rover).mobility()
        if samples >= 0:
            interference = find_interference(
                rover,
                samples=samples,
                seed=seed,
                time_limit=time_limit,
                shapes=shapes,
                progress=lambda what, fraction: say(what, 0.12 + 0.88 * fraction),
            )
            found += check_ranges(rover, interference)
    say("done", 1.0)
    found.sort(key=lambda finding: _ORDER[finding.severity])
    return CheckReport(findings=tuple(found), mobility=mobility, interference=interference)
