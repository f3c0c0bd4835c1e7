"""Scenes that move: for the page of replays and live sessions, for films and for other programs."""

from rille.view.scene3d.animation import animated_glb
from rille.view.scene3d.film import FILMS, Ghost, Take, shoot
from rille.view.scene3d.html import live_page, page
from rille.view.scene3d.page_source import Extra, Shown, source
from rille.view.scene3d.recorded import extras, recorded_trace
from rille.view.scene3d.scene import View, gravity_of, layout, scene_glb, view_of
from rille.view.scene3d.tracks import states

__all__ = [
    "FILMS",
    "Extra",
    "Ghost",
    "Shown",
    "Take",
    "View",
    "animated_glb",
    "extras",
    "gravity_of",
    "layout",
    "live_page",
    "page",
    "recorded_trace",
    "scene_glb",
    "shoot",
    "source",
    "states",
    "view_of",
]
