"""Simulators that break their promises in every way that we could think of.

Each fault sits in ``acceleration``, which find_gap integrates, or in ``step``, which policies learn
in; or the simulator declares what cannot be.
"""

from __future__ import annotations

import dataclasses
import itertools
import time

import numpy as np

from sims.pendulum_equation import PendulumEquation
from sims.simulator import Channel

_count = itertools.count()
_chaos = np.random.default_rng(0)


def _last(x, value):
    out = np.array(x, float)
    out[-1:] = value
    return out


def _raise(error):
    raise error


def _overwrite(rows, value):
    rows[:] = value
    return rows


#: What becomes of a sound answer ``x`` to ``rows``.
ANSWERS = {
    "Nan": lambda x, rows: x * np.nan,
    "NanInLastRow": lambda x, rows: _last(x, np.nan),
    "NanFarOut": lambda x, rows: np.where(np.abs(rows[:, :1]) > 1.0, np.nan, x),
    "Infinite": lambda x, rows: x + np.inf,
    "MinusInfinite": lambda x, rows: _last(x, -np.inf),
    "Huge": lambda x, rows: x * 1e300,
    "Tiny": lambda x, rows: x * 1e-300,
    "Flat": lambda x, rows: np.ravel(x),
    "Wide": lambda x, rows: np.hstack([x, x]),
    "Narrow": lambda x, rows: x[:, :0],
    "Short": lambda x, rows: x[:-1],
    "OneRow": lambda x, rows: x[:1],
    "Deep": lambda x, rows: x[None],
    "Number": lambda x, rows: 1.0,
    "Nothing": lambda x, rows: None,
    "Word": lambda x, rows: "word",
    "Objects": lambda x, rows: x.astype(object),
    "Complex": lambda x, rows: x + 1j,
    "Half": lambda x, rows: np.asarray(x, np.float16),
    "Whole": lambda x, rows: np.asarray(np.nan_to_num(x), int),
    "Listed": lambda x, rows: np.asarray(x).tolist(),
    "Random": lambda x, rows: x + 0.01 * _chaos.normal(size=np.shape(x)),
    "Counting": lambda x, rows: x + 1e-3 * next(_count),
    "ByOrder": lambda x, rows: x + 0.01 * np.arange(len(x))[:, None],
    "ByBatch": lambda x, rows: x + 0.1 * np.mean(rows),
    "Overwriting": lambda x, rows: x + 0 * _overwrite(rows, 0.0)[:, :1],
    "Raising": lambda x, rows: _raise(ZeroDivisionError("deliberate")),
    "RaisingFarOut": lambda x, rows: _raise(ValueError("too far")) if np.abs(rows).max() > 2 else x,
    "Lacking": lambda x, rows: rows.no_such_thing,
    "NeverReady": lambda x, rows: _raise(NotImplementedError()),
    "Leaving": lambda x, rows: _raise(OSError("the device is gone")),
    "Slow": lambda x, rows: time.sleep(0.0005) or x,
    "Wrapping": lambda x, rows: np.angle(np.exp(1j * x)),
    "Coarse": lambda x, rows: np.round(x, 1),
    "StateAsMask": lambda x, rows: x[rows[:, 0] > 0],
    "Denied": lambda x, rows: _raise(MemoryError("no memory left")),
}

_pendulum = PendulumEquation()
_angle, _rate = _pendulum.state_channels
(_voltage,) = _pendulum.action_channels
_other = dataclasses.replace

#: What is declared, by class attribute.
DECLARED = {
    "NoPeriod": {"dt": 0.0}, "NegativePeriod": {"dt": -0.05}, "NanPeriod": {"dt": np.nan},
    "EndlessPeriod": {"dt": np.inf}, "WordPeriod": {"dt": "0.05"}, "LackingPeriod": {"dt": None},
    "NoStates": {"state_channels": ()}, "NoChannels": {"state_channels": (), "action_channels": ()},
    "OneState": {"state_channels": (_angle,)}, "NoJoints": {"joints": ()},
    "TwiceNamed": {"state_channels": (_angle, _other(_rate, name="angle", rate_of="angle"))},
    "RateOfNothing": {"state_channels": (_angle, _other(_rate, rate_of="nothing"))},
    "NoInputs": {"action_channels": ()},
    "MoreInputs": {"action_channels": (_voltage, Channel("other", "V", "input"))},
    "UpsideDown": {"action_channels": (_other(_voltage, low=3.0, high=-3.0),)},
    "NanBounds": {"action_channels": (_other(_voltage, low=np.nan, high=np.nan),)},
    "NoScale": {"state_channels": (_angle, _other(_rate, scale=0.0))},
    "ChannelNames": {"state_channels": ("angle", "rate")}, "NoName": {"name": None},
    "NoParameters": {"parameters": None},
}  # fmt: skip


def _with_answer(name: str, answer) -> list[type]:
    def acceleration(self, q, v, u, force, p):
        return answer(PendulumEquation.acceleration(self, q, v, u, force, p), q)

    def step(self, states, actions):
        return answer(PendulumEquation.step(self, states, actions), np.asarray(states))

    return [
        type(f"{name}Acceleration", (PendulumEquation,), {"acceleration": acceleration}),
        type(f"{name}Step", (PendulumEquation,), {"step": step}),
    ]


def _declaring(name: str, attributes: dict) -> type:
    def begin(self, *given, **options):
        PendulumEquation.__init__(self, *given, **options)
        for key, value in attributes.items():
            setattr(self, key, value)

    return type(f"{name}Declared", (PendulumEquation,), {"__init__": begin})


FAULTY = {
    kind.__name__: kind
    for kind in (
        *(kind for name, answer in ANSWERS.items() for kind in _with_answer(name, answer)),
        *(_declaring(name, attributes) for name, attributes in DECLARED.items()),
    )
}
for _kind in FAULTY.values():
    _kind.__module__ = __name__
globals().update(FAULTY)

#: Faults that are none: what they do is within what is promised.
HARMLESS = {
    "HalfAcceleration", "HalfStep", "ListedAcceleration", "ListedStep", "ObjectsAcceleration",
    "WholeAcceleration", "CoarseAcceleration", "TinyAcceleration", "SlowAcceleration", "SlowStep",
    "WholeStep", "NoNameDeclared", "NoParametersDeclared",
}  # fmt: skip
