"""The data gate: what is wrong or remarkable in a recording, said before anything is made of it; nothing is changed."""

from rille.recording.gate.examine import gate

__all__ = ["gate"]
