"""The record of a run: written while it flies, read back whole or cut off, told as tables."""

from staniel.recording.reader import read_record
from staniel.recording.tables import export, tracks_table, truth_table
from staniel.recording.writer import Recorder

__all__ = ["Recorder", "export", "read_record", "tracks_table", "truth_table"]
