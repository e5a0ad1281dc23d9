"""Rows and policies on which Leo is tested."""

from pathlib import Path

import leo_reference as reference
import numpy as np

# States (n, 18) and actions (n, 6) of a policy that walks, as arrays s and a.
WALK = Path(__file__).parent / "leo_walk.npz"


def flying(n, seed=0):
    """Random states 1 m up, with random voltages."""
    rng = np.random.default_rng(seed)
    states = np.zeros((n, 18))
    states[:, 1] = 1.0
    states[:, 2:9] = rng.uniform(-0.7, 0.7, (n, 7))
    states[:, 5:7] = -np.abs(states[:, 5:7])
    states[:, 9:] = rng.uniform(-3, 3, (n, 9))
    return states, rng.uniform(-8, 8, (n, 6))


def standing(crouch=0.2):
    """A state (18,) on both flat feet, and the joint angles it holds."""
    joints = np.array([1, 1, -2, -2, 1, 1]) * crouch
    state = np.zeros(18)
    state[3:9] = joints
    state[1] -= reference.gaps(state[None]).min()
    return state, joints


def struggling(leo, n, seed=1):
    """What a walk's start and drunken voltages lead to: states in contact, and the voltages."""
    rng = np.random.default_rng(seed)
    states, actions = [], []
    while len(states) < n:
        state = np.zeros(18)
        state[3:9] = rng.uniform(-0.08, 0.08, 6)
        state[3:9] += [0.0, 0.82, -0.05, -1.27, 0.0, 0.0]
        state[5:7] = np.minimum(state[5:7], -0.02)
        state[1] -= reference.gaps(state[None]).min()
        noise = np.zeros(6)
        while abs(state[2]) < 1 and state[1] > -0.15 and np.abs(state[7:9]).max() < 1.13:
            noise += -0.15 * noise + 0.2 * rng.standard_normal(6)
            states.append(state)
            actions.append(8.6 * np.clip(noise, -1, 1))
            state = leo.step(state[None], actions[-1][None])[0]
    return np.array(states[:n]), np.array(actions[:n])


def walking():
    """States and voltages of a walk, from the file that was kept of one."""
    with np.load(WALK) as kept:
        return kept["s"], kept["a"]


def squat(step, states, joints):
    """Voltages (n, 6) that bend and stretch both legs once a second, leaning to and fro."""
    phase = 2 * np.pi * 0.03 * step
    bend = 0.15 * (1 - np.cos(phase)) * np.array([1, 1, -2, -2, 1, 1])
    lean = 0.04 * np.sin(0.5 * phase) * np.array([0, 0, 0, 0, 1, 1])
    return np.clip(30 * (joints + bend + lean - states[:, 3:9]), -8.6, 8.6)
