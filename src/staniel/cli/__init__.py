"""The command line. Whatever is heavy is imported inside the command that needs it."""

from staniel.cli.app import app, main

__all__ = ["app", "main"]
