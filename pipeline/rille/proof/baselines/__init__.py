"""What the field would do in place of a diagnosis: SINDy, a Gaussian process, tuning of every number. Each gets what diagnosis gets."""

from rille.proof.baselines.gaussian_process import gaussian_process
from rille.proof.baselines.names import BaselineAnswer
from rille.proof.baselines.residuals import ResidualTable, Scope
from rille.proof.baselines.sindy import sindy
from rille.proof.baselines.tuning import Tunable, Tuned, TunedNumber, named, tune

__all__ = ["BaselineAnswer", "ResidualTable", "Scope", "Tunable", "Tuned", "TunedNumber", "gaussian_process", "named", "sindy", "tune"]
