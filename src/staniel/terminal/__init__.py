"""What a person sees on the terminal while missions fly, and after."""

from staniel.terminal.flight import Reporter
from staniel.terminal.study import StudyReporter, print_summary

__all__ = ["Reporter", "StudyReporter", "print_summary"]
