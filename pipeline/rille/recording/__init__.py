"""Recordings: import, data gate, recorder."""

from rille.recording.columns import Targets, targets_of
from rille.recording.importing import Imported, import_recording
from rille.recording.manifest import Manifest, read_manifest

__all__ = ["Imported", "Manifest", "Targets", "import_recording", "read_manifest", "targets_of"]
