"""Pictures and numbers of a run. Takes values, draws files; knows no database.

Nothing here imports matplotlib or pyvista before it is called.
"""

from rille.view.render import render
from rille.view.summary import Summary, summary

__all__ = ["Summary", "render", "summary"]
