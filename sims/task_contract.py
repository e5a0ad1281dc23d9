"""What every task promises of its rows, and the refusal of one that breaks it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from sims.findings import draw
from sims.simulator import Array, Simulator, physical
from sims.tasks import Task
from sims.unsound import Unsound

_ROWS, _STARTS, _LEAST = 8, 20, 2
_ROUNDING = 1e-6


def refuse_unsound_task(task: Task, simulator: Simulator) -> None:
    """Refuse a task with which nothing could be learnt, before anything is computed.

    Args:
        task: Looked at on a few drawn rows, and on what one step makes of start states.
        simulator: Its channels name the columns; memory channels are not shown to tasks.

    Raises:
        Unsound: Its horizon is no count of steps, a start state does not fit the channels or lies
            where it ends episodes, rewards or terminations are not one for each row, depend on
            other rows or are not finite, or terminations are not true or false.
    """
    name = type(task).__name__
    names = [channel.name for channel in physical(simulator.state_channels)]
    fits = f"{name} does not fit {simulator.name} ({', '.join(names)})"
    horizon: Any = getattr(task, "horizon", None)
    whole = isinstance(horizon, int | np.integer) and not isinstance(horizon, bool)
    if not whole or horizon < _LEAST:
        raise Unsound(
            f"{name}.horizon is {horizon!r}, expected a whole number of steps from {_LEAST}: of an "
            "episode that ends with its first step nothing can be learnt"
        )
    starts = [_start(task, k, names, simulator, fits) for k in range(_STARTS)]
    rng = np.random.default_rng(0)
    states, actions = draw(simulator, _ROWS, rng)
    held = draw(simulator, _STARTS, rng)[1]
    with np.errstate(all="ignore"):
        drawn = _transitions(simulator, states, actions, len(names))
        begun = _transitions(simulator, simulator.augment(np.array(starts)), held, len(names))
        rewards = _by_row(task.reward, f"{name}.reward", drawn, fits)
        ends = _by_row(lambda s, a, n: task.terminal(n), f"{name}.terminal", drawn, fits)
        first = _asked(task.reward, f"{name}.reward", begun, fits)
        _refuse_no_truths(ends, drawn[2], name, names)
        _refuse_ended_starts(task, np.array(starts), drawn[2], names, fits)
    if rewards.dtype.kind not in "biuf":
        raise Unsound(f"{name}.reward returned {rewards.dtype}, expected real numbers")
    bad = np.flatnonzero(~np.isfinite(first) & np.isfinite(begun[2]).all(axis=1))
    if bad.size:
        raise Unsound(
            f"{name}.reward is {first[bad[0]]:g} one step after a start state, expected a finite "
            f"number; reached was {_told(names, begun[2][bad[0]])}"
        )


def _refuse_no_truths(ends: np.ndarray, reached: Array, name: str, names: list[str]) -> None:
    """Refuse terminations that are neither true nor false: any number but 0 would end episodes."""
    if ends.dtype.kind not in "biuf":
        raise Unsound(f"{name}.terminal returned {ends.dtype}, expected true or false by row")
    bad = np.flatnonzero(~np.isin(ends, (0, 1)) & np.isfinite(reached).all(axis=1))
    if bad.size:
        raise Unsound(
            f"{name}.terminal returned {ends[bad[0]]:.4g} at {_told(names, reached[bad[0]])}, "
            "expected true or false by row: compare, such as next_states[:, 0] > 1"
        )


def _refuse_ended_starts(
    task: Task, starts: Array, reached: Array, names: list[str], fits: str
) -> None:
    """Refuse a task that mostly starts where it ends episodes: nothing could be learnt."""

    def over(states: Array) -> np.ndarray:
        return _asked(task.terminal, f"{name}.terminal", (states,), fits).astype(bool)

    name = type(task).__name__
    bad = starts[over(starts)]
    if len(bad) <= len(starts) / 2:
        return
    # Which channel it is: one that alone brings a start back if it is as elsewhere.
    elsewhere = np.vstack([np.zeros(len(names)), reached[np.isfinite(reached).all(axis=1)]])
    guilty = []
    for column, channel in enumerate(names):
        moved = np.tile(bad[0], (len(elsewhere), 1))
        moved[:, column] = elsewhere[:, column]
        if not over(moved).all():
            guilty.append(channel)
    why = f" (it is {' and '.join(guilty)})" if guilty else ""
    raise Unsound(
        f"{name}.terminal is true of {len(bad)} of {len(starts)} states that {name}.start gives, "
        f"such as {_told(names, bad[0])}{why}: every episode would end at once; change where "
        "episodes start, or when terminal() is true"
    )


def _told(names: list[str], state: Array) -> str:
    return ", ".join(f"{name} {value:.4g}" for name, value in zip(names, state, strict=True))


def _start(task: Task, seed: int, names: list[str], simulator: Simulator, fits: str) -> Array:
    """One start state, as long as the channels say."""
    what = f"{type(task).__name__}.start"
    given = _asked(lambda: task.start(np.random.default_rng(seed)), what, (), fits)
    if given.shape not in ((len(names),), (len(simulator.state_channels),)):
        raise Unsound(
            f"{what} returned shape {given.shape}, expected ({len(names)},): one number for each "
            f"of {', '.join(names)}"
        )
    if given.dtype.kind not in "iuf" or not np.isfinite(given).all():
        raise Unsound(f"{what} returned {given.tolist()}, expected finite numbers")
    return np.asarray(given[: len(names)], float)


def _transitions(simulator: Simulator, states: Array, actions: Array, width: int) -> Any:
    reached = simulator.step(states, actions)
    return states[:, :width], actions, np.asarray(reached)[:, :width]


def _by_row(ask: Callable[..., Any], what: str, rows: tuple[Array, ...], fits: str) -> np.ndarray:
    """What a task says of rows, once it says the same of each alone."""
    said = _asked(ask, what, rows, fits)
    count = len(rows[0])
    columns = "compute with columns such as next_states[:, 0], which have one entry for each row"
    if said.shape != (count,):
        raise Unsound(f"{what} returned shape {said.shape} for {count} rows, expected ({count},): "
                      f"{columns}")  # fmt: skip
    for i in range(count):
        alone = _asked(ask, what, tuple(array[i : i + 1] for array in rows), fits)
        same = alone.shape == (1,) and (
            np.allclose(alone, said[i], rtol=_ROUNDING, atol=_ROUNDING, equal_nan=True)
        )
        if not same:
            raise Unsound(
                f"{what} gives {alone.tolist()} for a row alone and {said[i]} for the same row "
                f"among {count}, expected the same number, and no random ones: {columns}"
            )
    return said


def _asked(ask: Callable[..., Any], what: str, rows: tuple[Array, ...], fits: str) -> np.ndarray:
    """The answer as an array; rows are copies, and have to be left as they were."""
    given = [array.copy() for array in rows]
    try:
        said = np.asarray(ask(*given))
    except Exception as error:
        raise Unsound(f"{fits}: {what} raised {type(error).__name__}: {error}") from error
    if not all(np.array_equal(a, b, equal_nan=True) for a, b in zip(given, rows, strict=True)):
        raise Unsound(f"{what} overwrites its arguments: copy them first")
    return said
