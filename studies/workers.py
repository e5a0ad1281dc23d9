"""Where trials run: in local processes, on a Dask cluster or on a Ray cluster.

Clusters are the user's own: a scheduler that already runs, whose workers can import this
package and see the output folder under the same path. They are used through their own calls
rather than joblib's, because these tell which trial lost its worker and run only that one
again; a trial whose worker has died several times is given up.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, Literal

from joblib import Parallel, delayed
from joblib.externals.loky.process_executor import TerminatedWorkerError

from studies.watching import running

Config = Mapping[str, Any]
# Computes one trial into its folder; returns its traceback if it failed.
Attempt = Callable[[Config, Path], str | None]
Ended = tuple[Path, str | None]
Run = Callable[[Attempt, Mapping[Path, Config]], Iterator[Ended]]
Backend = Literal["local", "dask", "ray"]

DEATHS = 3  # of a process in a row, after which a trial is given up; Dask's default, too
CONNECT_SECONDS = 20


class WorkersError(RuntimeError):
    """The cluster cannot be used; the user can mend it."""


@contextlib.contextmanager
def workers(backend: Backend, jobs: int = 1, scheduler: str | None = None) -> Iterator[Run]:
    """Connect to where trials run.

    Args:
        backend: ``"local"``, ``"dask"`` or ``"ray"``.
        jobs: Local processes; 1 is this one.
        scheduler: Address of the cluster's scheduler, such as ``"tcp://host:8786"`` (Dask),
            ``"ray://host:10001"`` or ``"auto"`` (Ray).

    Yields:
        A function that runs trials and yields each folder as it ends, with the traceback if it
        failed.

    Raises:
        WorkersError: The cluster's package is not installed, there is no scheduler at the
            address, its workers run several trials at once in one process, or it was lost.
    """
    if backend == "local":
        yield lambda attempt, trials: _in_processes(attempt, trials, jobs)
        return
    if not scheduler:
        raise WorkersError(f"--backend {backend} needs the address of a cluster: --scheduler")
    with (_dask if backend == "dask" else _ray)(scheduler) as run:
        yield run


def _in_processes(attempt: Attempt, trials: Mapping[Path, Config], jobs: int) -> Iterator[Ended]:
    waiting: dict[Path, Config] = {**trials}
    deaths = 0
    while waiting:
        calls = [delayed(_named)(attempt, config, folder) for folder, config in waiting.items()]
        # Ready results come back at once, so that the view moves and failures are seen early.
        ended = Parallel(n_jobs=jobs, return_as="generator_unordered")(calls)
        try:
            for folder, failure in ended:
                del waiting[folder]
                deaths = 0
                yield folder, failure
        except TerminatedWorkerError:
            # One process died, which ends the others: what they had begun is begun again.
            deaths += 1
            begun = running(waiting)
            if deaths == DEATHS:
                for folder in list(begun or waiting):
                    del waiting[folder]
                    yield folder, f"its process was killed {DEATHS} times (out of memory?)\n"
                deaths = 0


def _named(attempt: Attempt, config: Config, folder: Path) -> Ended:
    return folder, attempt(config, folder)


@contextlib.contextmanager
def _dask(scheduler: str) -> Iterator[Run]:
    try:
        import distributed
    except ModuleNotFoundError:
        raise WorkersError("Dask is not installed: pip install 'simgap[dask]'") from None
    try:
        client = distributed.Client(scheduler, timeout=CONNECT_SECONDS)
    except (OSError, ValueError) as problem:
        raise WorkersError(f"no Dask scheduler at {scheduler}: {problem}") from None

    def run(attempt: Attempt, trials: Mapping[Path, Config]) -> Iterator[Ended]:
        futures = {
            client.submit(attempt, config, folder, pure=False): folder
            for folder, config in trials.items()
        }
        for future in distributed.as_completed(list(futures)):
            folder = futures.pop(future)
            if future.status == "cancelled":
                raise WorkersError(
                    f"the Dask scheduler at {scheduler} was lost: start it and give the "
                    "same command again; finished trials are kept"
                )
            # An error here is not the trial's: its worker died too often, or cannot import it.
            failure = repr(future.exception()) if future.status == "error" else future.result()
            yield folder, failure

    with client:
        for worker in client.scheduler_info(n_workers=-1)["workers"].values():
            if worker["nthreads"] > 1:
                raise WorkersError(
                    f"Dask worker {worker['name']} has {worker['nthreads']} threads, which slow "
                    "each other down: start one worker per core with --nthreads 1"
                )
        yield run


@contextlib.contextmanager
def _ray(scheduler: str) -> Iterator[Run]:
    try:
        import ray
    except ModuleNotFoundError:
        raise WorkersError("Ray is not installed: pip install 'simgap[ray]'") from None
    try:
        ray.init(scheduler, log_to_driver=False)
    except (OSError, ValueError) as problem:
        raise WorkersError(f"no Ray cluster at {scheduler}: {problem}") from None

    def run(attempt: Attempt, trials: Mapping[Path, Config]) -> Iterator[Ended]:
        remote = ray.remote(num_cpus=1, max_retries=DEATHS)(_named)
        waiting = {remote.remote(attempt, trials[folder], folder): folder for folder in trials}
        while waiting:
            (ready,), _ = ray.wait(list(waiting), num_returns=1)
            folder = waiting.pop(ready)
            try:
                _, failure = ray.get(ready)
            except ray.exceptions.RayError as problem:
                failure = repr(problem)
            yield folder, failure

    try:
        yield run
    finally:
        ray.shutdown()
