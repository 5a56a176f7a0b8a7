"""Fly tasks on workers, write each outcome down, and get over workers that die."""

from collections import Counter, deque
from collections.abc import Callable, Iterable
from concurrent.futures import FIRST_COMPLETED, Future, wait
from typing import Final

from staniel.studies.journal import Journal
from staniel.studies.mission import Outcome, Task
from staniel.studies.workers import WorkerDied, Workers

__all__ = ["execute"]

_TRIES: Final = 2
"""How often a run is begun by itself, after a worker died, before it is given up."""

_GLANCE: Final = 0.2
"""How often it is looked whether somebody wants to stop [s]."""

Listener = Callable[..., None]


def execute(tasks: Iterable[Task], workers: Workers, journal: Journal, tell: Listener) -> None:
    """Fly all tasks.

    A worker that dies takes all others of its pool with it. Every run that was being flown is then
    begun again, one at a time: what loses its worker twice all by itself is given up.

    Parameters
    ----------
    tasks : iterable of Task
    workers : Workers
    journal : Journal
        Takes the outcomes, in whatever order they come.
    tell : callable
        ``tell("run", outcome=...)`` after each, ``tell("wait")`` several times a second; what it
        raises ends the execution.

    Raises
    ------
    OutputError
        The journal cannot be written.
    StudyError
        There are no workers any more.
    """
    queue = _Queue(tasks, workers.width)
    flying: dict[Future[Outcome], Task] = {}
    while True:
        while (task := queue.take(len(flying))) is not None:
            flying[workers.submit(task)] = task
        if not flying:
            return
        ended, _ = wait(flying, timeout=_GLANCE, return_when=FIRST_COMPLETED)
        tell("wait")
        for future in ended:
            task = flying.pop(future)
            try:
                outcome = workers.result(future)
            except WorkerDied as death:
                if queue.put_back(task):
                    continue
                outcome = Outcome(task.point, task.seed, died=str(death) or "its worker died")
            queue.finished(task)
            journal.add(outcome)
            tell("run", outcome=outcome)


class _Queue:
    """Tasks in turn; those that lost a worker come first, and each by itself."""

    def __init__(self, tasks: Iterable[Task], width: int) -> None:
        self._tasks = iter(tasks)
        # Two a worker, so that none is idle while an outcome is written down.
        self._room = 2 * width
        self._suspects: deque[Task] = deque()
        self._lost: Counter[tuple[int, int]] = Counter()

    def take(self, flying: int) -> Task | None:
        """The next task, None when there is none or it must wait for those `flying`."""
        if self._suspects:
            return self._suspects.popleft() if flying == 0 else None
        # While a suspect is flying, it flies alone.
        room = 1 if self._lost else self._room
        return next(self._tasks, None) if flying < room else None

    def put_back(self, task: Task) -> bool:
        """Whether a task that lost its worker is to be begun again."""
        key = task.point, task.seed
        self._lost[key] += 1
        if self._lost[key] > _TRIES:
            return False
        self._suspects.append(task)
        return True

    def finished(self, task: Task) -> None:
        """Forget what was held against a task."""
        del self._lost[task.point, task.seed]
