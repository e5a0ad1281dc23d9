"""Is a simulator what everything above relies on? ``check_simulator`` tells in plain words."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike

from sims.contract import contract, declared
from sims.effects.base import Effect
from sims.effects.joint import ConstantLoad
from sims.effects.library import library, typical
from sims.effects.parameter import ParameterChange
from sims.equation_contract import (
    acceleration_keeps,
    forces_act,
    linear_in_forces,
    parameters_by_row,
)
from sims.equations import EquationOfMotion, FirstOrderSystem
from sims.findings import Finding, Findings, draw, example
from sims.host import HostSimulator
from sims.simulator import Array, Simulator

#: Shares of a usual change of a parameter that are tried, until one stays finite: of one that is
#: zero nobody knows what is much.
_SHARES = (1.0, 1e-2, 1e-4)


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
    if states is not None and actions is not None:
        states, actions = simulator.check_rows(states, actions)
    rng = rng or np.random.default_rng(0)
    return Findings(_until_it_raises(_checks(simulator, states, actions, rng)))


def _until_it_raises(checks: Iterator[Finding]) -> Iterator[Finding]:
    try:
        yield from checks
    except Exception as error:
        says = f"{type(error).__name__}: {error}; expected numbers for every row"
        yield Finding("raises", False, says)


def _checks(
    simulator: Simulator,
    states: ArrayLike | None,
    actions: ArrayLike | None,
    rng: np.random.Generator,
) -> Iterator[Finding]:
    findings = []
    for finding in declared(simulator):
        findings.append(finding)
        yield finding
    if not all(finding.ok for finding in findings):
        return
    if states is None or actions is None:
        given = actions if states is None else states
        drawn = draw(simulator, 24 if given is None else len(np.asarray(given)), rng)
        states = drawn[0] if states is None else states
        actions = drawn[1] if actions is None else actions
    states, actions = simulator.check_rows(states, actions)
    for finding in contract(simulator, states, actions, rng):
        findings.append(finding)
        yield finding
    if not all(finding.ok for finding in findings):
        return
    yield from _to_the_bounds(simulator, rng)
    if isinstance(simulator, EquationOfMotion):
        yield acceleration_keeps(simulator, states, actions)
        acts = forces_act(simulator, states, actions)
        yield acts
        if acts.ok:
            yield linear_in_forces(simulator, states, actions)
    yield from _parameters(simulator, states, actions)
    if isinstance(simulator, EquationOfMotion | FirstOrderSystem):
        yield parameters_by_row(simulator, states, actions)
    if isinstance(simulator, HostSimulator):
        yield from _effects(simulator, rng)


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


def _parameters(simulator: Simulator, states: Array, actions: Array) -> Iterator[Finding]:
    before = simulator.step(states, actions)
    for name, parameter in (getattr(simulator, "parameters", None) or {}).items():
        size = np.max(np.abs(parameter.value)) or parameter.scale
        for share in _SHARES:
            value = parameter.value + 0.05 * share * size
            if np.any(value > parameter.high):
                value = parameter.value - 0.05 * share * size
            try:
                with np.errstate(all="ignore"):
                    after = simulator.with_parameters(**{name: value}).step(states, actions)
            except NotImplementedError:
                return
            if np.isfinite(after).all():
                break
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
        for share in _SHARES if isinstance(effect, ParameterChange) else (1.0,):
            some = typical(effect, plain, share)
            host = plain.with_effects([some])
            # A command that has just changed its sign shows what delays, lags and plays do.
            with np.errstate(all="ignore"):
                after = host.step(host.augment(states, -actions), actions)[:, : states.shape[1]]
            if np.isfinite(after).all():
                break
        finding = _reaches(check, before, after, f"to {_strength(some)}")
        if not finding.ok and isinstance(effect, ParameterChange):
            finding = _beside_loads(plain, some, states, actions) or finding
        by_row = host.take(slice(None)).with_effects([_per_row(some, len(states))])
        rows = by_row.step(by_row.augment(states, -actions), actions)[:, : states.shape[1]]
        if finding.ok and not np.array_equal(rows, after):
            finding = Finding(check, False, "one value per row differs from the same scalar")
        yield finding


def _beside_loads(
    plain: HostSimulator, change: Effect, states: Array, actions: Array
) -> Finding | None:
    """Whether a parameter that cancels out, as the mass of a pendulum that swings freely, counts
    beside a load on every joint; None if it does not."""
    loads = [e for e in library(plain) if isinstance(e, ConstantLoad)]
    loaded = [typical(load, plain, 1.0) for load in loads]
    with np.errstate(all="ignore"):
        before, after = (
            plain.with_effects(effects).step(states, actions)
            for effects in (loaded, [*loaded, change])
        )
    says = f"to {_strength(change)} beside a load"
    finding = _reaches(f"effect {change}", before, after, says)
    return finding if finding.ok else None


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
