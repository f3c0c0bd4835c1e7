"""From a difference between model and measurement to a better model. The simulator is always an argument."""

from rille.diagnosis.soil_fit import FitResult, Repeatability, fit_soil, repeatability

__all__ = ["FitResult", "Repeatability", "fit_soil", "repeatability"]
