"""Ctrl-C ends a command in one way, wherever it lands."""

import contextlib
import signal
import subprocess
import sys
import time
from pathlib import Path

import cffi
import pytest

from studies.running.ending import guarded, passing_on_interrupts


def test_control_c_in_a_study(tmp_path):
    command = [sys.executable, "-m", "studies.pendulum_gap", "--output", str(tmp_path / "out")]
    root = Path(__file__).parents[2]
    # A suite in the background ignores interrupts, and so would what it starts.
    process = subprocess.Popen(
        command, stderr=subprocess.PIPE, text=True, cwd=root,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )  # fmt: skip
    end = time.monotonic() + 120
    while not (tmp_path / "out").exists():
        assert time.monotonic() < end and process.poll() is None
        time.sleep(0.1)
    time.sleep(1)
    said = None
    while said is None:
        # Compiled code may swallow an interrupt; who sees that it goes on presses again.
        assert time.monotonic() < end + 120
        process.send_signal(signal.SIGINT)
        with contextlib.suppress(subprocess.TimeoutExpired):
            said = process.communicate(timeout=30)[1]
    assert process.returncode == 130
    assert said.endswith("stopped; the same command goes on\n") and "Traceback" not in said


def test_control_c_in_a_callback_is_passed_on(capsys):
    ffi = cffi.FFI()

    def free(_):
        raise KeyboardInterrupt

    # What a shell starts in the background ignores interrupts.
    usual = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt), passing_on_interrupts():
            freed = ffi.gc(ffi.new("int*"), free)
            del freed
            for _ in range(200):  # an interrupt of this kind waits for the end of a sleep
                time.sleep(0.05)
    finally:
        signal.signal(signal.SIGINT, usual)
    assert capsys.readouterr().err == ""


def test_what_fails_because_control_c_cut_a_callback_short_is_an_interrupt(capsys):
    ffi = cffi.FFI()

    def free(_):
        raise KeyboardInterrupt

    @guarded()
    def compile_something(arguments):
        compiled = ffi.gc(ffi.new("int*"), free)
        del compiled
        raise RuntimeError("no compiled object yet")

    with pytest.raises(SystemExit) as ended:
        compile_something([])
    time.sleep(0.2)  # no second interrupt comes after the end
    assert ended.value.code == 130
    assert capsys.readouterr().err == "\nstopped; the same command goes on\n"
