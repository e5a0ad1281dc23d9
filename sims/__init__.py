"""Simulators: pure, batched systems that host named physical effects, and tasks on them.

Names are loaded when they are used.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

from sims.registration import register

if TYPE_CHECKING:
    from sims.checks import check_simulator
    from sims.environment import SimulatorEnv
    from sims.equations import EquationOfMotion, FirstOrderSystem
    from sims.leo import Leo, Walking
    from sims.loading import load_simulator
    from sims.pendulum import Pendulum
    from sims.protocol import EvaluationProtocol
    from sims.simulator import Channel, Parameter, Simulator
    from sims.system import System
    from sims.tasks import SwingUp, Task

_HOMES = {
    "Channel": "simulator",
    "EquationOfMotion": "equations",
    "EvaluationProtocol": "protocol",
    "FirstOrderSystem": "equations",
    "Leo": "leo",
    "Parameter": "simulator",
    "Pendulum": "pendulum",
    "Simulator": "simulator",
    "SimulatorEnv": "environment",
    "SwingUp": "tasks",
    "System": "system",
    "Task": "tasks",
    "Walking": "leo",
    "check_simulator": "checks",
    "load_simulator": "loading",
}

__all__ = [
    "Channel",
    "EquationOfMotion",
    "EvaluationProtocol",
    "FirstOrderSystem",
    "Leo",
    "Parameter",
    "Pendulum",
    "Simulator",
    "SimulatorEnv",
    "SwingUp",
    "System",
    "Task",
    "Walking",
    "check_simulator",
    "load_simulator",
]


def __getattr__(name: str) -> object:
    if name not in _HOMES:
        raise AttributeError(f"module 'sims' has no attribute {name!r}")
    return getattr(importlib.import_module(f"sims.{_HOMES[name]}"), name)


register()
