"""Logs of a walking Leo as its sensors would write them: noisy encoders, rates if asked for."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from jsonargparse.typing import NonNegativeFloat, PositiveInt

from policy.evaluate import collect
from policy.learner import Algorithm, load_policy
from policy.noise import OrnsteinUhlenbeck
from residual.logs.writing import write_log
from residual.trajectories import Trajectory
from sims.environment import SimulatorEnv
from sims.leo import Leo, Walking

#: Sub-steps of 0.04 ms, a fifth of what find_gap explains the log with.
SUBSTEPS = 150
#: Noise of x and z in m, of angles in rad, and of rates in m/s and rad/s.
PLACE, ANGLE, RATE = 1e-3, 2e-3, 0.1
#: Transitions below which a walk tells next to nothing: it fell at once.
SHORTEST = 14


def write_walks(
    folder: Path,
    policy: str | Path,
    learner: Algorithm | None = None,
    torso_mass: float = 1.25,
    friction: NonNegativeFloat = 0.03,
    transitions: PositiveInt = 1000,
    exploration: NonNegativeFloat = 0.08,
    rates: bool = False,
    seed: int = 0,
) -> list[Path]:
    """Write walks as CSV files, one for each episode, cut at its fall.

    Args:
        folder: Where to.
        policy: Of ``policies/`` that studies.leo_gap leaves, or the import path of one of your own,
            with ``act`` or ``predict``.
        learner: The algorithm that learnt the policy, if it is not ``policy.DDPG``.
        torso_mass: kg; 0.94226 is the idealised Leo.
        friction: Viscous friction of all joints, N m s/rad.
        transitions: Control steps of 0.03 s in all; those of episodes shorter than 14 steps are
            not written.
        exploration: Exploration noise, as ``--ddpg.noise_sigma``.
        rates: Whether rates were measured too.
        seed: Of starts, exploration and sensor noise.

    Returns:
        The files.
    """
    leo = Leo(torso_mass, friction, substeps=SUBSTEPS)
    env = SimulatorEnv(leo, Walking(start_at="around"))
    rng = np.random.default_rng(seed)
    walker = learner.load(Path(policy), env).policy if learner else load_policy(policy)
    noise = OrnsteinUhlenbeck(6, exploration, 0.15, rng)
    spread = np.repeat([PLACE, ANGLE, RATE if rates else np.nan], [2, 7, 9])
    paths: list[Path] = []
    for run in collect(walker, env, transitions, 1000 * seed, noise):
        if len(run.actions) < SHORTEST or run.states is None:
            continue
        seen = run.states + spread * rng.standard_normal(run.states.shape)
        walk = Trajectory("walk", leo.dt * np.arange(len(seen), dtype=float), seen, run.actions)
        paths.append(folder / f"walk-{len(paths) + 1:02d}.csv")
        write_log(paths[-1], walk, leo.state_channels, leo.action_channels)
    if not paths:
        raise ValueError(
            f"every walk of {policy} fell within {SHORTEST} steps: give a policy that walks, or "
            "less exploration"
        )
    return paths
