"""rille: planetary-rover simulation from CAD and terrain to diagnosis, through one SQLite database."""

__version__ = "0.7.0"
