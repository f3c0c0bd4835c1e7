"""Writes recordings as files of every format that import reads, with the manifest that brings them in again."""

from rille.recording.writing.address import Address
from rille.recording.writing.formats import FORMATS, find_format, write_recording_file
from rille.recording.writing.manifest_text import HIDEABLE, manifest_text

__all__ = ["FORMATS", "HIDEABLE", "Address", "find_format", "manifest_text", "write_recording_file"]
