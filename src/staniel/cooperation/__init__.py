"""What the team agrees: who watches which target, who helps whom, and where to search."""

from staniel.cooperation.allocation import Allocation
from staniel.cooperation.assistance import Assistance
from staniel.cooperation.auction import Assignment, assign
from staniel.cooperation.config import Area, CooperationConfig, CostConfig, priority_at
from staniel.cooperation.cost import CostModel, Goal, Price, Situation
from staniel.cooperation.gate import Gate
from staniel.cooperation.search import SearchMap
from staniel.cooperation.searcher import Searcher
from staniel.cooperation.table import Holding, Task

__all__ = [
    "Allocation",
    "Area",
    "Assignment",
    "Assistance",
    "CooperationConfig",
    "CostConfig",
    "CostModel",
    "Gate",
    "Goal",
    "Holding",
    "Price",
    "SearchMap",
    "Searcher",
    "Situation",
    "Task",
    "assign",
    "priority_at",
]
