"""What every simulator promises of its rows, and the refusal of one that breaks it."""

from __future__ import annotations

import re
import traceback
from collections.abc import Iterator, Mapping

import numpy as np

from sims.declared import is_period
from sims.equation_contract import (
    ROUNDING,
    acceleration_keeps,
    drive_tells,
    forces_act,
    linear_in_forces,
    parameters_by_row,
)
from sims.equations import EquationOfMotion, FirstOrderSystem
from sims.findings import Finding, draw, example
from sims.simulator import Array, Channel, Parameter, Simulator
from sims.unsound import Unsound

#: What makes every number of a simulator worthless.
_GRAVE = (
    "period", "channels", "parameters", "shape", "arguments", "repeatable", "pure", "rows",
    "arguments of acceleration", "forces", "linear in forces", "parameters by row", "drive_force",
)  # fmt: skip


def refuse_unsound(simulator: Simulator) -> None:
    """Refuse a simulator about which no answer could be right, before anything is computed.

    Raises:
        ValueError: It has no period or no channels, raises, returns rows of another shape,
            overwrites its arguments, gives other numbers for the same rows, or is an equation of
            motion that no force on a joint moves.
    """
    if isinstance(simulator, type):
        called = simulator.__name__
        raise Unsound(f"simulator {called} is a class, expected one of it: {called}()")
    if not isinstance(simulator, Simulator):
        raise Unsound(f"simulator is of type {type(simulator).__name__}, expected a Simulator")
    name = f"simulator {getattr(simulator, 'name', type(simulator).__name__)}"
    try:
        with np.errstate(all="ignore"):  # what is not finite is told with the state it came from
            for finding in _sound(simulator):
                if not finding.ok and finding.check in _GRAVE:
                    raise Unsound(f"{name}: {finding.check}: {finding.says:.400}")
    except Unsound:
        raise
    except Exception as error:
        then = _of_one_number(error) or "try sims.check_simulator"
        raise Unsound(f"{name} raised {type(error).__name__}: {error}; {then}") from error


def _of_one_number(error: Exception) -> str:
    """What to do if a line failed that has a function of the module ``math``."""
    frames = traceback.extract_tb(error.__traceback__)
    failed = frames[-1].line or "" if frames else ""
    arrays = isinstance(error, TypeError) and re.search(r"\bmath\.", failed)
    return "it is given arrays, a row for each state: np.sin, not math.sin" if arrays else ""


def _sound(simulator: Simulator) -> Iterator[Finding]:
    yield from declared(simulator)
    rng = np.random.default_rng(0)
    states, actions = draw(simulator, 6, rng)
    yield from contract(simulator, states, actions, rng)
    whole = simulator.step(states, actions)
    alone = simulator.step(states[:1], actions[:1])
    turned = simulator.step(states[::-1], actions[::-1])[::-1]
    # Libraries may round a batch otherwise than a row; that harms nobody.
    same = all(
        np.allclose(one, whole[: len(one)], rtol=ROUNDING, atol=0, equal_nan=True)
        for one in (alone, turned)
    )
    yield Finding("rows", same, "a row's result depends on the rows beside it")
    if isinstance(simulator, EquationOfMotion):
        yield acceleration_keeps(simulator, states, actions)
        yield forces_act(simulator, states, actions)
        yield linear_in_forces(simulator, states, actions)
    if isinstance(simulator, EquationOfMotion | FirstOrderSystem):
        yield parameters_by_row(simulator, states, actions)
        yield drive_tells(simulator, states, actions)


def declared(simulator: Simulator) -> Iterator[Finding]:
    """Is there a period, and a channel?"""
    dt = simulator.dt
    good = is_period(dt)
    says = f"every {dt:g} s" if good else f"dt is {dt!r}, expected seconds > 0"
    yield Finding("period", good, says)
    wrong = _wrong_channels(simulator)
    says = wrong or f"{len(simulator.state_channels)} of the state"
    yield Finding("channels", not wrong, says)
    if says := _wrong_parameters(simulator):
        yield Finding("parameters", False, says)


def _wrong_channels(simulator: Simulator) -> str:
    """What is wrong with the channels, if anything is."""
    channels = [*simulator.state_channels, *simulator.action_channels]
    if not simulator.state_channels:
        return "there is no state channel: declare every column"
    for channel in channels:
        if not isinstance(channel, Channel):
            return f"{channel!r:.40} is no sims.Channel"
        if not channel.low <= channel.high:
            return f"{channel.name!r} is bounded by {channel.low} and {channel.high}: no value fits"
        if not 0 < channel.scale < np.inf:
            return f"the scale of {channel.name!r} is {channel.scale}, expected a finite size > 0"
    names = [channel.name for channel in channels]
    for channel in channels:
        if names.count(channel.name) > 1:
            return f"{names.count(channel.name)} channels are called {channel.name!r}"
        if channel.rate_of is not None and channel.rate_of not in names:
            return f"{channel.name!r} is the rate of {channel.rate_of!r}, which is no channel"
    return ""


def _wrong_parameters(simulator: Simulator) -> str:
    """What is wrong with the parameters, if there are any and anything is."""
    given = getattr(simulator, "parameters", {})
    if not isinstance(given, Mapping):
        return f"parameters is a {type(given).__name__}, expected them by name"
    for name, one in given.items():
        inside = not isinstance(one, Parameter) or (one.low <= one.value) & (one.value <= one.high)
        if not np.all(inside):
            return f"{name!r} is {one.value}, outside its own bounds {one.low:g} and {one.high:g}"
    return ""


def contract(
    simulator: Simulator, states: Array, actions: Array, rng: np.random.Generator
) -> Iterator[Finding]:
    """Step some rows, and step them again in every way that must not matter."""
    given = states.copy(), actions.copy()
    following = simulator.step(states, actions)
    if not isinstance(following, np.ndarray):
        says = f"step returned a {type(following).__name__}, expected an array of {states.shape}"
        yield Finding("shape", False, says)
        return
    if following.shape != states.shape:
        says = f"step returned shape {following.shape} for states of shape {states.shape}"
        yield Finding("shape", False, says)
        return
    if following.dtype.kind not in "fiu":
        yield Finding("shape", False, f"step returned {following.dtype}, expected real numbers")
        return
    yield Finding("shape", True, f"(n, {states.shape[1]}) in and out")
    kept = np.array_equal(given[0], states) and np.array_equal(given[1], actions)
    says = "the arguments are left as they were" if kept else "step overwrites its arguments"
    yield Finding("arguments", kept, says)
    states, actions = given
    bad = np.flatnonzero(~np.isfinite(following).all(axis=1))
    yield Finding(
        "finite",
        not bad.size,
        example("step gives", bad, states, actions, following, following)
        if bad.size
        else f"all {len(states)} rows stay finite",
    )

    def same(check: str, again: Array, good: str, wrong: str) -> Finding:
        rows = np.flatnonzero((again != following).any(axis=1) & np.isfinite(following).all(axis=1))
        says = example(wrong, rows, states, actions, following, again) if rows.size else good
        return Finding(check, not rows.size, says)

    again = simulator.step(states, actions)
    yield same(
        "repeatable",
        again,
        "the same rows give the same bits",
        "the same rows stepped twice differ; no random numbers and no memory may be left",
    )
    simulator.step(states[::-1] * 0.5, actions[::-1])
    again = simulator.step(states, actions)
    yield same(
        "pure",
        again,
        "what was stepped before does not matter",
        "the result depends on what was stepped before; reset every hidden state in step",
    )
    alone = np.concatenate(
        [simulator.step(states[i : i + 1], actions[i : i + 1]) for i in range(len(states))]
    )
    yield same(
        "batch",
        alone,
        "a row alone gives the same bits as in a batch",
        "a row alone differs from the same row in a batch; use elementwise operations only",
    )
    order = rng.permutation(len(states))
    shuffled = np.empty_like(following)
    shuffled[order] = simulator.step(states[order], actions[order])
    yield same(
        "order",
        shuffled,
        "the order of the rows does not matter",
        "rows in another order differ",
    )
    yield from _turns(simulator, states, actions, following)
    if simulator.action_channels:
        yield _bounds(simulator, states, actions)


def _bounds(simulator: Simulator, states: Array, actions: Array) -> Finding:
    """Actions beyond their bounds must act like their bounds."""
    beyond = [
        channel.high + 1.0 if np.isfinite(channel.high) else column
        for channel, column in zip(simulator.action_channels, actions[0], strict=True)
    ]
    edge = [
        channel.high if np.isfinite(channel.high) else column
        for channel, column in zip(simulator.action_channels, actions[0], strict=True)
    ]
    clipped = np.array_equal(
        simulator.step(states[:1], [beyond]), simulator.step(states[:1], [edge])
    )
    says = (
        "actions are clipped to their bounds"
        if clipped
        else (f"the action {beyond} does not act like its bound {edge}; use check_rows in step")
    )
    return Finding("bounds", clipped, says)


def _turns(
    simulator: Simulator, states: Array, actions: Array, following: Array
) -> Iterator[Finding]:
    """An angle must not be wrapped: a start one turn further ends one turn further."""
    for column, channel in enumerate(simulator.state_channels):
        if not channel.angle:
            continue
        moved = states.copy()
        moved[:, column] += 4 * np.pi
        further = simulator.step(moved, actions)[:, column] - following[:, column]
        # Other forces than those of whole turns may move it a little differently.
        ok = bool(np.all(np.abs(further - 4 * np.pi) < np.pi))
        says = (
            "is not wrapped"
            if ok
            else "two turns further on, the next angle is not two turns further on; do not wrap it"
        )
        yield Finding(f"angle {channel.name}", ok, says)
