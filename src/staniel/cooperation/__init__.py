"""What the team agrees: who watches which target, and where to search."""

from staniel.cooperation.allocation import Allocation, Holding, Task
from staniel.cooperation.config import CooperationConfig
from staniel.cooperation.gate import Gate
from staniel.cooperation.helping import Helping
from staniel.cooperation.search import SearchMap

__all__ = ["Allocation", "CooperationConfig", "Gate", "Helping", "Holding", "SearchMap", "Task"]
