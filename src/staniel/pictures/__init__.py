"""Pictures of a run, drawn from its record alone."""

from staniel.pictures.causes import draw_causes
from staniel.pictures.movie import draw_movie
from staniel.pictures.overview import draw_overview

__all__ = ["draw_causes", "draw_movie", "draw_overview"]
