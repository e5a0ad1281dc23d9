"""find_gap and MuJoCo's own system identification on the same logs, side by side."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from residual.gap import find_gap
from studies.reporting.markdown import filled
from studies.robots.cases import NAMES, nominal
from studies.robots.drives import measure
from studies.robots.peer import forecast_error, identify

#: What is hidden in the arm of two joints; the last record of each is held out.
HIDDEN: tuple[dict[str, float], ...] = (
    {"frictionloss of joint elbow": 0.06},
    {"mass of body fore": 0.1},
    {"frictionloss of joint elbow": 0.06, "mass of body fore": 0.1},
    {},
)


Interval = tuple[float, float, float]


def compare(robot: str, hidden: Mapping[str, float], minutes: float) -> Iterator[dict[str, Any]]:
    """find_gap, and then ``mujoco.sysid``, on the same logs.

    Args:
        robot: A shipped model with hinges and motors.
        hidden: See ``studies.robots.truth.Truth``.
        minutes: Budget of find_gap.

    Yields:
        ``who``; ``named``, hidden names that it named, with value and interval; ``false``, other
        names; ``error``, root mean square of positions over 0.3 s on the held-out record in mrad,
        and ``nominal``, the nominal's; ``seconds`` of processor time.
    """
    *logs, held = measure(robot, dict(hidden))
    simulator = nominal(robot)
    before = 1e3 * forecast_error(simulator, [held])

    def side(who: str, names: Mapping[str, Interval], error: float, spent: float) -> dict[str, Any]:
        right = [f"{name} {_number(names[name])}" for name in hidden if name in names]
        false = [name for name in names if name not in hidden]
        return {
            "who": who,
            "named": "; ".join(right) or "-",
            "false": f"{len(false)}: {', '.join(false)}" if false else "none",
            "error": 1e3 * error,
            "nominal": before,
            "seconds": spent,
        }

    begin = time.process_time()
    result = find_gap(simulator, logs, minutes=minutes)
    seconds = time.process_time() - begin
    named = {}
    for verdict in result.verdicts:
        if verdict.effect and verdict.kind in NAMES:
            number = next(iter(verdict.parameters.values()))
            named[verdict.effect] = (number.value, number.low, number.high)
    yield side("find_gap", named, forecast_error(result.corrected, [held]), seconds)
    fitted = identify(simulator, logs)
    changes = {}
    for name in fitted.significant:
        value, half, usual = fitted.values[name]
        changes[name] = (value - usual, value - usual - half, value - usual + half)
    values = {name: value for name, (value, _, _) in fitted.values.items()}
    error = forecast_error(simulator, [held], values)
    yield side("mujoco.sysid", changes, error, fitted.seconds)


def table(tell: Callable[[str], None], minutes: float = 1.0) -> str:
    """Markdown for the arm with two joints."""
    rows = []
    for hidden in HIDDEN:
        words = " + ".join(f"{name} {size:+g}" for name, size in hidden.items()) or "nothing"
        tell(f"arm2: {words}")
        rows += [{"hidden": words} | side for side in compare("arm2", hidden, minutes)]
    columns = {
        "hidden": "{hidden}",
        "": "{who}",
        "named: change (95 % interval)": "{named}",
        "false names": "{false}",
        "held-out error": "{error:.2f} mrad (nominal {nominal:.2f})",
        "s": "{seconds:.0f}",
    }
    return filled(rows, columns)


def _number(value: Interval) -> str:
    return f"{value[0]:+.4g} ({value[1]:.4g} to {value[2]:.4g})"
