"""Who flies the runs of a study: processes of this machine, or a Dask cluster."""

import os
import signal
import threading
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import connection, get_context, parent_process
from typing import Any, Protocol

from staniel._version import __version__
from staniel.errors import StudyError
from staniel.studies.mission import Outcome, Task, fly_task

__all__ = ["CONNECT_WITHIN", "Cluster", "Processes", "WorkerDied", "Workers"]

CONNECT_WITHIN = 10
"""A scheduler that does not answer for so long is not there [s]."""


class WorkerDied(Exception):  # noqa: N818 - what happened, to whom is asked for the result
    """The process that flew a run ended before the run did."""


class Workers(Protocol):
    """What flies tasks, several at a time."""

    @property
    def width(self) -> int:
        """How many it flies at the same time."""
        ...

    def submit(self, task: Task) -> "Future[Outcome]":
        """Begin a task."""
        ...

    def result(self, future: "Future[Outcome]") -> Outcome:
        """Outcome of a task that has ended.

        Raises
        ------
        WorkerDied
        """
        ...

    def stop(self) -> None:
        """End at once; what is being flown is lost."""
        ...


class Processes:
    """Processes of this machine, one a core unless told otherwise.

    Parameters
    ----------
    count : int, optional
        At least 1; all processor cores that this process may use when not given.
    """

    def __init__(self, count: int | None = None) -> None:
        self._count = count or _cores()
        self._pool: ProcessPoolExecutor | None = None

    @property
    def width(self) -> int:
        """How many runs are flown at the same time."""
        return self._count

    def submit(self, task: Task) -> "Future[Outcome]":
        """Begin a task; starts the processes where there are none, or one of them died."""
        for _ in range(2):
            try:
                return self._started().submit(fly_task, task)
            except BrokenProcessPool:
                self.stop()
        raise StudyError("workers: the processes die as soon as they are started")

    def result(self, future: "Future[Outcome]") -> Outcome:
        """See `Workers`."""
        try:
            return future.result()
        except BrokenProcessPool as error:
            self.stop()
            raise WorkerDied(str(error)) from error

    def stop(self) -> None:
        """Kill the processes: the runs they are flying are not worth waiting for."""
        pool, self._pool = self._pool, None
        if pool is not None:
            processes = list((pool._processes or {}).values())
            pool.shutdown(wait=False, cancel_futures=True)
            for process in processes:
                process.kill()
            for process in processes:
                process.join()

    def _started(self) -> ProcessPoolExecutor:
        if self._pool is None:
            # Not forked: a fork copies the locks of threads that it does not copy.
            self._pool = ProcessPoolExecutor(self._count, get_context("spawn"), _begin)
        return self._pool


class Cluster:
    """The workers of a Dask scheduler.

    Parameters
    ----------
    address : str
        Such as ``tcp://10.0.0.1:8786``.

    Raises
    ------
    StudyError
        Dask is not installed, nobody answers, there is no worker, or one has another version of
        staniel.
    """

    def __init__(self, address: str) -> None:
        try:
            import distributed
        except ImportError as error:
            raise StudyError(
                "scheduler: Dask distributed is not installed; expected the extra: "
                'pip install "staniel[cluster]"'
            ) from error
        dask: Any = distributed  # it has no types
        try:
            self._client = dask.Client(address, timeout=CONNECT_WITHIN, set_as_default=False)
        except (OSError, ValueError, TypeError, ImportError) as error:
            raise StudyError(
                f"scheduler {address}: cannot be reached ({error}); expected the address of a "
                "Dask scheduler, such as tcp://127.0.0.1:8786"
            ) from error
        self._address = address
        try:
            self._check()
        except StudyError:
            self._client.close()
            raise
        # A run whose worker dies is begun anew elsewhere by the scheduler, a few times.
        self._executor = self._client.get_executor(pure=False)

    @property
    def width(self) -> int:
        """Threads of all workers now; workers may come and go."""
        threads: dict[str, int] = self._client.nthreads()
        return max(1, sum(threads.values()))

    def submit(self, task: Task) -> "Future[Outcome]":
        """See `Workers`."""
        future: Future[Outcome] = self._executor.submit(fly_task, task)
        return future

    def result(self, future: "Future[Outcome]") -> Outcome:
        """See `Workers`.

        Raises
        ------
        WorkerDied
        StudyError
            The scheduler is gone.
        """
        from concurrent.futures import CancelledError

        from distributed import KilledWorker

        try:
            return future.result()
        except KilledWorker as error:
            raise WorkerDied(str(error)) from error
        except (CancelledError, OSError) as error:
            raise StudyError(
                f"scheduler {self._address}: gone ({error or type(error).__name__}); what was "
                "flown is kept, the same command goes on with the rest"
            ) from error

    def stop(self) -> None:
        """Leave the cluster; what was not begun is cancelled."""
        self._executor.shutdown(wait=False)
        self._client.close()

    def _check(self) -> None:
        try:
            versions = self._client.run(_version)
        except Exception as error:
            raise StudyError(
                f"scheduler {self._address}: a worker cannot import staniel ({error}); expected "
                f"staniel {__version__} on every worker"
            ) from error
        if not versions:
            raise StudyError(f"scheduler {self._address}: it has no workers, expected some")
        for worker, version in versions.items():
            if version != __version__:
                raise StudyError(
                    f"scheduler {self._address}: worker {worker} has staniel {version}, expected "
                    f"{__version__} everywhere: results would not be of one version"
                )


def _version() -> str:
    return __version__


def _cores() -> int:
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not on every system
        return os.cpu_count() or 1


def _begin() -> None:
    """Prepare a worker process: a Ctrl-C is its parent's to handle, and it ends with its parent."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = parent_process()
    if parent is not None:
        connection.wait([parent.sentinel])
        os._exit(1)
