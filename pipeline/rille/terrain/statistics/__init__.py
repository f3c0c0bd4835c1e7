"""What a DEM says of itself: roughness, slopes, spectrum, craters, rocks."""

from rille.terrain.statistics.forms import find_craters, find_rocks
from rille.terrain.statistics.increments import Deviogram, Slopes, deviogram, slopes
from rille.terrain.statistics.matched import Found
from rille.terrain.statistics.report import measure, roughness
from rille.terrain.statistics.samples import Samples, Surface, sample
from rille.terrain.statistics.size_frequency import Census, census
from rille.terrain.statistics.spectrum import Spectrum, spectrum

__all__ = [
    "Census",
    "Deviogram",
    "Found",
    "Samples",
    "Slopes",
    "Spectrum",
    "Surface",
    "census",
    "deviogram",
    "find_craters",
    "find_rocks",
    "measure",
    "roughness",
    "sample",
    "slopes",
    "spectrum",
]
