"""The page as rille puts it together, for tests."""

from pathlib import Path

from rille.view.scene3d.html import page as whole
from rille.view.scene3d.html import script
from rille.view.scene3d.html import three_js as three

WEB = Path(__file__).resolve().parents[2] / "pipeline" / "rille" / "view" / "web"
NAMES = (WEB / "order.txt").read_text().split()

__all__ = ["NAMES", "WEB", "page", "script", "three"]


def page(source: dict, title: str = "rille") -> str:
    """The page that shows a source."""
    return whole(source, title)
