"""Fixtures of the browser."""

from browser import browser, tab

__all__ = ["browser", "tab"]
