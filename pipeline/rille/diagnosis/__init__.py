"""From a difference between model and measurement to a better model. The simulator is always an argument."""

from rille.diagnosis.bench.repeatability import Repeatability, repeatability
from rille.diagnosis.bench.soil_fit import FitResult, fit_soil
from rille.diagnosis.comparison.compare import compare_whole, compare_windows
from rille.diagnosis.comparison.compare_inverse import compare_inverse
from rille.diagnosis.starts.noise_floor import shared_noise

__all__ = ["FitResult", "Repeatability", "compare_inverse", "compare_whole", "compare_windows", "fit_soil", "repeatability", "shared_noise"]
