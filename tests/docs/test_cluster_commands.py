"""The clusters that docs/scaling.md starts, with a study on them, listen on the loopback only."""

import contextlib
import os
import re
import secrets
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import psutil
import pytest

ROOT = Path(__file__).parents[2]
QUICK = ROOT / "tests/studies/quick_gap.py"
GRID = """
budget: {iterations: 1, true_samples: 40, idealised_steps: 500, difference_steps: 400}
ddpg: {hidden: [16, 16], warm_up: 300}
estimator: {class_path: residual.Linear}
grid:
- seed: [0, 1]
"""
#: Of every process that comes from a command of the page.
MARK = "SIMGAP_TEST_CLUSTER"


def blocks(tool):
    """The lines of the page's block of shell commands that use a tool, on ports that are free."""
    text = (ROOT / "docs/scaling.md").read_text().replace("\\\n", " ")
    (block,) = (b for b in re.findall(r"```\n(.*?)```", text, re.DOTALL) if re.search(tool, b))
    for port in ("8786", "8787", "6399"):
        block = re.sub(rf"\b{port}\b", str(free_port()), block)
    return [" ".join(line.split()) for line in block.splitlines()]


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class Cluster:
    """What the page's commands start, known by a mark in its environment."""

    def __init__(self, folder):
        self.folder, self.started = folder, []
        self.environment = {
            **os.environ, MARK: secrets.token_hex(8), "OMP_NUM_THREADS": "1",
            "PYTHONPATH": os.pathsep.join((str(ROOT), str(QUICK.parent))),
        }  # fmt: skip

    def start(self, line):
        self.started.append(subprocess.Popen(
            line.removesuffix("&").split(), cwd=self.folder, env=self.environment,
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        ))  # fmt: skip
        return self.started[-1]

    def processes(self):
        """Those with the mark, and their children: Ray's agents write over their environment."""
        found = set()
        for process in psutil.process_iter():
            with contextlib.suppress(psutil.Error):
                if process.environ().get(MARK) == self.environment[MARK]:
                    found |= {process, *process.children(recursive=True)}
        return found

    def listening(self):
        """By process the addresses that it listens on."""
        found = {}
        for process in self.processes():
            with contextlib.suppress(psutil.Error):
                links = process.net_connections("tcp")
                found[process.pid] = {c.laddr.ip for c in links if c.status == psutil.CONN_LISTEN}
        return {pid: addresses for pid, addresses in found.items() if addresses}

    def study(self, line):
        """Do the page's study with trials of a second, and tell where anybody listens meanwhile."""
        (self.folder / "grid.yaml").write_text(GRID)
        line = line.replace("python -m studies.pendulum_gap", f"{sys.executable} {QUICK}")
        line = re.sub(r"\S+\.yaml", "grid.yaml", line)
        running, found = self.start(line), self.listening()
        while running.poll() is None:
            found |= self.listening()
            time.sleep(0.3)
        assert running.returncode == 0
        results = [*self.folder.glob("results/*/grid/*-seed*/results.json")]
        assert len(results) == 2
        return found

    def stop(self):
        for process in self.processes():
            with contextlib.suppress(psutil.Error):
                process.send_signal(signal.SIGKILL)
        for process in self.started:
            process.wait()


@pytest.fixture
def cluster():
    # Names of sockets below it have to be short.
    folder = Path(tempfile.mkdtemp(prefix="s-"))
    made = Cluster(folder)
    try:
        yield made
    finally:
        made.stop()
        shutil.rmtree(folder, ignore_errors=True)


def on_loopback(found):
    """Also as IPv6 writes it."""
    addresses = {address.removeprefix("::ffff:") for address in set().union(*found.values())}
    return addresses <= {"127.0.0.1", "::1"}


@pytest.mark.long
def test_local_processes_listen_nowhere(cluster):
    (line,) = blocks("--jobs 2")
    assert not cluster.study(line)


def dask(cluster):
    """Start what the page starts, and return the page's study once all of it listens."""
    pytest.importorskip("distributed")
    *lines, study = blocks("dask scheduler")
    for line in lines:
        cluster.start(line)
    end = time.monotonic() + 90
    # A scheduler, what nurses the workers, and two of them.
    while len(cluster.listening()) < 4:
        assert time.monotonic() < end, cluster.listening()
        time.sleep(0.5)
    return study


def test_a_documented_dask_cluster_listens_on_the_loopback_only(cluster):
    dask(cluster)
    assert on_loopback(found := cluster.listening()), found


@pytest.mark.long
def test_a_study_on_a_documented_dask_cluster_listens_nowhere_else(cluster):
    study = dask(cluster)
    assert on_loopback(found := cluster.study(study)), found


@pytest.mark.long
def test_a_documented_ray_cluster_listens_on_the_loopback_only(cluster):
    pytest.importorskip("ray")
    start, study, _ = blocks("ray start")
    assert cluster.start(f"env {start} --temp-dir {cluster.folder / 'ray'}").wait(120) == 0
    found = cluster.study(study)
    # The store, a raylet, the client's server, an agent; the command and a worker.
    assert len(found) >= 6, found
    assert on_loopback(found), found
