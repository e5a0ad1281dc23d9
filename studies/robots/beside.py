"""find_gap and MuJoCo's own system identification on the same logs, side by side."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable, Sequence

from residual.gap import find_gap
from studies.robots.cases import nominal
from studies.robots.drives import measure
from studies.robots.peer import forecast_error, identify

#: What is hidden in the arm of two joints; the last record of each is held out.
HIDDEN: tuple[dict[str, float], ...] = (
    {"frictionloss of joint elbow": 0.06},
    {"mass of body fore": 0.1},
    {"frictionloss of joint elbow": 0.06, "mass of body fore": 0.1},
    {},
)


@dataclasses.dataclass(frozen=True)
class Side:
    """What one of the two said of one set of logs.

    Attributes:
        who: ``"find_gap"`` or ``"mujoco.sysid"``.
        right: Hidden names that it named, with value and interval.
        false: Other names.
        error: Root mean square of positions over 0.3 s on the held-out record, in rad.
        seconds: Processor time.
    """

    who: str
    right: dict[str, tuple[float, float, float]]
    false: tuple[str, ...]
    error: float
    seconds: float


def compare(
    robot: str, hidden: dict[str, float], minutes: float = 1.0, seed: int = 0
) -> tuple[float, list[Side]]:
    """Both on the same logs.

    Args:
        robot: A shipped model with hinges and motors.
        hidden: See ``studies.robots.truth.Truth``.
        minutes: Budget of find_gap.
        seed: Of motion and noise.

    Returns:
        The nominal's error on the held-out record, and what each said.
    """
    *logs, held = measure(robot, hidden, seed=seed)
    simulator = nominal(robot)
    begin = time.process_time()
    result = find_gap(simulator, logs, minutes=minutes)
    seconds = time.process_time() - begin
    named = {}
    for verdict in result.verdicts:
        if verdict.effect and verdict.kind in ("confirmed", "ambiguous", "minor"):
            number = next(iter(verdict.parameters.values()))
            named[verdict.effect] = (number.value, number.low, number.high)
    ours = Side(
        "find_gap",
        {name: named[name] for name in hidden if name in named},
        tuple(name for name in named if name not in hidden),
        forecast_error(result.corrected, [held]),
        seconds,
    )
    fitted = identify(simulator, logs)
    values = {name: value for name, (value, _, _) in fitted.values.items()}
    changes = {
        name: (value - nominal_, value - nominal_ - half, value - nominal_ + half)
        for name, (value, half, nominal_) in fitted.values.items()
    }
    theirs = Side(
        "mujoco.sysid",
        {name: changes[name] for name in fitted.significant if name in hidden},
        tuple(name for name in fitted.significant if name not in hidden),
        forecast_error(simulator, [held], values),
        fitted.seconds,
    )
    return forecast_error(simulator, [held]), [ours, theirs]


def table(tell: Callable[[str], None], minutes: float = 1.0) -> str:
    """Markdown for the arm with two joints."""
    lines = [
        "| hidden | | named: change (95 % interval) | false names | held-out error | s |",
        "|---|---|---|---|---|---|",
    ]
    for hidden in HIDDEN:
        words = " + ".join(f"{name} {size:+g}" for name, size in hidden.items()) or "nothing"
        tell(f"arm2: {words}")
        before, sides = compare("arm2", hidden, minutes)
        for side in sides:
            named = "; ".join(f"{n} {_number(v)}" for n, v in side.right.items()) or "-"
            lines.append(
                f"| {words} | {side.who} | {named} | {_listed(side.false)} | "
                f"{1e3 * side.error:.2f} mrad (nominal {1e3 * before:.2f}) | {side.seconds:.0f} |"
            )
    return "\n".join(lines)


def _number(value: tuple[float, float, float]) -> str:
    return f"{value[0]:+.4g} ({value[1]:.4g} to {value[2]:.4g})"


def _listed(names: Sequence[str]) -> str:
    return f"{len(names)}: {', '.join(names)}" if names else "none"
