"""Pictures of a run, drawn from its record alone."""

from staniel.pictures.movie import draw_movie
from staniel.pictures.overview import draw_overview

__all__ = ["draw_movie", "draw_overview"]
