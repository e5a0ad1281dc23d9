"""The cluster that docs/scaling.md starts listens on the loopback only."""

import os
import re
import signal
import socket
import subprocess
import time
from pathlib import Path

import psutil
import pytest

ROOT = Path(__file__).parents[2]


def commands():
    """The background commands of the page, on ports that are free."""
    text = (ROOT / "docs/scaling.md").read_text().replace("\\\n", " ")
    found = re.findall(r"^(dask .*?)\s*&$", text, re.MULTILINE)
    assert [line.split()[1] for line in found] == ["scheduler", "worker"]
    for port in ("8786", "8787"):
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            free = str(probe.getsockname()[1])
        found = [line.replace(port, free) for line in found]
    return [line.split() for line in found]


def listening(processes):
    """Addresses that these processes and their children listen on."""
    family = [p for top in processes for p in (top, *top.children(recursive=True))]
    return {
        p.pid: {c.laddr.ip for c in p.net_connections("tcp") if c.status == psutil.CONN_LISTEN}
        for p in family
    }


def test_a_documented_cluster_listens_on_the_loopback_only(tmp_path):
    pytest.importorskip("distributed")
    started = [
        subprocess.Popen(
            command, cwd=tmp_path, stderr=subprocess.DEVNULL, start_new_session=True
        )
        for command in commands()
    ]  # fmt: skip
    try:
        tops = [psutil.Process(process.pid) for process in started]
        end = time.monotonic() + 90
        # A scheduler, a nanny of each of two workers, and the workers.
        while sum(map(bool, (found := listening(tops)).values())) < 4:
            assert time.monotonic() < end, found
            time.sleep(0.5)
        time.sleep(1)
        assert set().union(*listening(tops).values()) <= {"127.0.0.1", "::1"}
    finally:
        for process in started:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
