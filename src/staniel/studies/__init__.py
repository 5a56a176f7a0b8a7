"""Monte Carlo studies: many runs over factors and seeds, with intervals."""

from staniel.studies.load import load_study, study_names
from staniel.studies.model import Study
from staniel.studies.results import Results, read_results
from staniel.studies.run import run

__all__ = ["Results", "Study", "load_study", "read_results", "run", "study_names"]
