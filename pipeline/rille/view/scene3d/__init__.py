"""Scenes that move: for the page of replays and live sessions, and for export."""

from rille.view.scene3d.html import live_page, page
from rille.view.scene3d.page_source import Extra, Shown, source
from rille.view.scene3d.scene import View, gravity_of, layout, scene_glb, view_of
from rille.view.scene3d.tracks import states

__all__ = ["Extra", "Shown", "View", "gravity_of", "layout", "live_page", "page", "scene_glb", "source", "states", "view_of"]
