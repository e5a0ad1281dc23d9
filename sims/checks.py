"""Is a simulator what everything above relies on? ``check_simulator`` tells in plain words."""

from __future__ import annotations

from collections.abc import Iterator
from types import SimpleNamespace

import numpy as np
from numpy.typing import ArrayLike

from sims.effects.base import Effect
from sims.effects.library import library, typical
from sims.equations import EquationOfMotion
from sims.findings import Finding, Findings, draw, example
from sims.host import HostSimulator
from sims.simulator import Array, Simulator


def check_simulator(
    simulator: Simulator,
    states: ArrayLike | None = None,
    actions: ArrayLike | None = None,
    rng: np.random.Generator | None = None,
) -> Findings:
    """Test the contract of a simulator on some rows.

    Args:
        simulator: Any simulator; one that hosts effects is tested with each of them too.
        states: shape (n, n_s), where to test; random within the channels' scales if None.
        actions: shape (n, n_a), likewise.
        rng: Source of random rows; a fixed seed by default.

    Returns:
        One finding per check. ``print(findings)`` is the report, a table; the simulator keeps
        the contract if ``all(finding.ok for finding in findings)``.
    """
    declared = Findings(_declared(simulator))
    if not all(finding.ok for finding in declared):
        return declared
    rng = rng or np.random.default_rng(0)
    if states is None or actions is None:
        given = actions if states is None else states
        drawn = draw(simulator, 24 if given is None else len(np.asarray(given)), rng)
        states = drawn[0] if states is None else states
        actions = drawn[1] if actions is None else actions
    states, actions = simulator.check_rows(states, actions)
    findings = Findings((*declared, *_contract(simulator, states, actions, rng)))
    if all(finding.ok for finding in findings):
        findings += _to_the_bounds(simulator, rng)
        if isinstance(simulator, EquationOfMotion):
            findings.append(_linear(simulator, states, actions))
        findings += _parameters(simulator, states, actions)
        if isinstance(simulator, HostSimulator):
            findings += _effects(simulator, rng)
    return findings


def _declared(simulator: Simulator) -> Iterator[Finding]:
    good = bool(np.isfinite(simulator.dt) and simulator.dt > 0)
    says = f"every {simulator.dt:g} s" if good else f"dt is {simulator.dt!r}, expected seconds > 0"
    yield Finding("period", good, says)
    count = len(simulator.state_channels)
    says = f"{count} of the state" if count else "there is no state channel: declare every column"
    yield Finding("channels", bool(count), says)


def _to_the_bounds(simulator: Simulator, rng: np.random.Generator) -> Iterator[Finding]:
    """Bounds that channels declare are promises: what lies between them can be stepped."""
    states, actions = draw(simulator, 64, rng)
    wide = False
    for rows, channels in (
        (states, simulator.state_channels),
        (actions, simulator.action_channels),
    ):
        for column, channel in enumerate(channels):
            if np.isfinite([channel.low, channel.high]).all() and channel.kind != "memory":
                rows[:, column] = rng.uniform(channel.low, channel.high, len(rows))
                rows[:2, column] = channel.low, channel.high
                wide = True
    if not wide:
        return
    with np.errstate(all="ignore"):
        following = np.asarray(simulator.step(states.copy(), actions.copy()))
    bad = np.flatnonzero(~np.isfinite(following).all(axis=1))
    says = f"all {len(states)} rows up to the channels' bounds stay finite"
    if bad.size:
        says = example("within the channels' bounds", bad, states, actions, following, following)
    yield Finding("finite to the bounds", not bad.size, says)


def _linear(simulator: EquationOfMotion, states: Array, actions: Array) -> Finding:
    """Effects add forces, so twice the force must give twice the change of acceleration."""
    names = [channel.name for channel in simulator.state_channels]
    q = states[:, [names.index(joint.position) for joint in simulator.joints]]
    v = states[:, [names.index(str(joint.rate)) for joint in simulator.joints]]
    values = SimpleNamespace(**simulator.parameter_values())
    for j, joint in enumerate(simulator.joints):
        force = np.zeros((3, *q.shape))
        force[1:, :, j] = np.array([[1.0], [2.0]]) * simulator.force_scale(joint)
        rest, once, twice = (
            simulator.acceleration(q.copy(), v.copy(), actions.copy(), each, values)
            for each in force
        )
        error = np.abs((twice - rest) - 2 * (once - rest)).max()
        if not error <= 1e-8 * np.abs([rest, once, twice]).max():
            says = (
                f"twice the force on {joint.name} does not change the acceleration by twice as much"
            )
            return Finding("linear in forces", False, says)
    return Finding("linear in forces", True, "twice the force, twice the change of acceleration")


def _contract(
    simulator: Simulator, states: Array, actions: Array, rng: np.random.Generator
) -> Iterator[Finding]:
    given = states.copy(), actions.copy()
    following = np.asarray(simulator.step(states, actions))
    if following.shape != states.shape:
        says = f"step returned {following.shape} for states of shape {states.shape}"
        yield Finding("shape", False, says)
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


def _parameters(simulator: Simulator, states: Array, actions: Array) -> Iterator[Finding]:
    before = simulator.step(states, actions)
    for name, parameter in (getattr(simulator, "parameters", None) or {}).items():
        size = np.max(np.abs(parameter.value)) or 1.0
        value = parameter.value + 0.05 * size
        if np.any(value > parameter.high):
            value = parameter.value - 0.05 * size
        try:
            after = simulator.with_parameters(**{name: value}).step(states, actions)
        except NotImplementedError:
            return
        yield _reaches(f"parameter {name}", before, after, f"from {parameter.value} to {value}")


def _effects(simulator: HostSimulator, rng: np.random.Generator) -> Iterator[Finding]:
    plain = simulator.with_effects(())
    states, actions = draw(plain, 24, rng)
    before = plain.step(states, actions)
    for effect in library(plain):
        check = f"effect {effect}"
        absent = plain.with_effects([effect]).step(states, actions)
        if not np.array_equal(absent, before):
            yield Finding(check, False, "at zero strength it changes the result")
            continue
        some = typical(effect, plain)
        host = plain.with_effects([some])
        # A command that has just changed its sign shows what delays, lags and plays do.
        after = host.step(host.augment(states, -actions), actions)[:, : states.shape[1]]
        finding = _reaches(check, before, after, f"to {_strength(some)}")
        by_row = host.take(slice(None)).with_effects([_per_row(some, len(states))])
        rows = by_row.step(by_row.augment(states, -actions), actions)[:, : states.shape[1]]
        if finding.ok and not np.array_equal(rows, after):
            finding = Finding(check, False, "one value per row differs from the same scalar")
        yield finding


def _per_row(effect: Effect, n: int) -> Effect:
    return effect.with_values(
        **{name: np.full(n, getattr(effect, name)) for name in effect.strengths()}
    )


def _strength(effect: Effect) -> str:
    return ", ".join(f"{name} {getattr(effect, name):.3g}" for name in effect.strengths())


def _reaches(check: str, before: Array, after: Array, change: str) -> Finding:
    if not np.isfinite(after).all():
        return Finding(check, False, f"changed {change} it gives values that are not finite")
    ok = bool(np.any(after != before))
    moved = np.abs(after - before).max(axis=0)
    amounts = ", ".join(f"{amount:.2g}" for amount in moved)
    says = f"changed {change} it moves the channels by up to {amounts}"
    return Finding(check, ok, says if ok else f"changed {change} it does not reach the output")
