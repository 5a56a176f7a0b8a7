"""What the team agrees: who watches which target, and where to search."""

from staniel.cooperation.allocation import Allocation, Holding, Task
from staniel.cooperation.config import Area, CooperationConfig, priority_at
from staniel.cooperation.helping import Helping
from staniel.cooperation.search import SearchMap

__all__ = [
    "Allocation",
    "Area",
    "CooperationConfig",
    "Helping",
    "Holding",
    "SearchMap",
    "Task",
    "priority_at",
]
