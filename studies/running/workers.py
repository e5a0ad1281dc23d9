"""Where trials run: in local processes, on a Dask cluster or on a Ray cluster.

Clusters are the user's own: a scheduler that already runs, whose workers can import this
package and see the output folder under the same path. They are used through their own calls
rather than joblib's, because these tell which trial lost its worker and run only that one
again; a trial whose worker has died several times is given up.
"""

from __future__ import annotations

import contextlib
import os
import socket
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path
from typing import Any, Literal

from joblib.externals.loky import ProcessPoolExecutor
from joblib.externals.loky.process_executor import BrokenProcessPool

Config = Mapping[str, Any]
# Computes one trial into its folder; returns its traceback if it failed.
Attempt = Callable[[Config, Path], str | None]
Ended = tuple[Path, str | None]
Run = Callable[[Attempt, Mapping[Path, Config]], Iterator[Ended]]
Backend = Literal["local", "dask", "ray"]

DEATHS = 3  # of a trial's process, after which the trial is given up; as Dask does by default
ONE_THREAD = {
    name: "1"
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "BLIS_NUM_THREADS")
}
CONNECT_SECONDS = 20
_RAY_ON_LOOPBACK = "RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER"
_LOST = "the {} at {} was lost: start it and give the same command again; nothing finished is lost"


class WorkersError(OSError):
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
    if jobs == 1:
        for folder, config in trials.items():
            yield folder, attempt(config, folder)
        return
    # One pool for each process: when a process dies it takes no other trial with it.
    pools: dict[int, ProcessPoolExecutor] = {}
    stopped = threading.Event()

    def run(config: Config, folder: Path) -> Ended:
        slot = threading.get_ident()
        for _ in range(DEATHS):
            if slot not in pools:
                pools[slot] = ProcessPoolExecutor(
                    1, initializer=_end_with, initargs=(os.getpid(),), env=ONE_THREAD
                )
            try:
                return folder, pools[slot].submit(attempt, config, folder).result()
            except BrokenProcessPool:
                if stopped.is_set():
                    break
                del pools[slot]
        return folder, f"its process was killed {DEATHS} times (out of memory?)\n"

    threads = ThreadPoolExecutor(jobs)
    try:
        ended = [threads.submit(run, config, folder) for folder, config in trials.items()]
        for future in as_completed(ended):
            yield future.result()
    finally:  # also when the user interrupts
        stopped.set()
        threads.shutdown(wait=False, cancel_futures=True)
        for pool in list(pools.values()):
            pool.shutdown(kill_workers=True)


def _end_with(parent: int) -> None:
    """Let this process end when the one that started it was killed."""

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(1)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


@contextlib.contextmanager
def _dask(scheduler: str) -> Iterator[Run]:
    try:
        import distributed
    except ModuleNotFoundError:
        raise WorkersError(
            "--backend dask needs the package dask: "
            "`pip install 'dask[distributed]'` (extra `dask`)"
        ) from None
    try:
        client = distributed.Client(scheduler, timeout=CONNECT_SECONDS)
    # A TLS scheduler without a certificate of one's own is a TypeError.
    except (OSError, ValueError, TypeError) as problem:
        raise WorkersError(f"no Dask scheduler at {scheduler}: {problem}") from None

    def run(attempt: Attempt, trials: Mapping[Path, Config]) -> Iterator[Ended]:
        futures = {
            client.submit(attempt, config, folder, pure=False): folder
            for folder, config in trials.items()
        }
        for future in distributed.as_completed(list(futures)):
            folder = futures.pop(future)
            if future.status == "cancelled":
                raise WorkersError(_LOST.format("Dask scheduler", scheduler))
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
    host, _, port = scheduler.removeprefix("ray://").rpartition(":")
    if host in ("127.0.0.1", "localhost"):
        # Else it takes the loopback for this machine's address in its network.
        os.environ.setdefault(_RAY_ON_LOOPBACK, "0")
    try:
        import ray
    except ModuleNotFoundError:
        raise WorkersError(
            "--backend ray needs the package ray: `pip install ray` (extra `ray`)"
        ) from None
    try:
        if host:  # Ray itself would wait for many minutes
            socket.create_connection((host, int(port)), CONNECT_SECONDS).close()
        ray.init(scheduler, log_to_driver=False)
    except (OSError, ValueError, RuntimeError) as problem:
        raise WorkersError(f"no Ray cluster at {scheduler}: {problem}") from None

    def run(attempt: Attempt, trials: Mapping[Path, Config]) -> Iterator[Ended]:
        def call(config: Config, folder: Path) -> str | None:
            return attempt(config, folder)

        remote = ray.remote(num_cpus=1, max_retries=DEATHS)(call)
        waiting = {remote.remote(config, folder): folder for folder, config in trials.items()}
        while waiting:
            (ready,), _ = ray.wait(list(waiting), num_returns=1)
            folder = waiting.pop(ready)
            try:
                failure = ray.get(ready)
            except ray.exceptions.LocalRayletDiedError:
                raise WorkersError(_LOST.format("Ray cluster", scheduler)) from None
            except ray.exceptions.RayError as problem:
                failure = repr(problem)
            yield folder, failure

    try:
        yield run
    finally:
        ray.shutdown()
