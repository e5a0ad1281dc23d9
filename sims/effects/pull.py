"""What a simulator pulls at a joint with by where the joint is, as gravity pulls at an arm."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

if TYPE_CHECKING:
    from sims.host import HostSimulator
    from sims.simulator import Array

#: Places, in scales of a position, at which forces on a joint are compared.
ELSEWHERE = (-0.7, 0.0, 0.4, 1.0)
#: Places in a turn, and the part of the pull there that rounding may differ by.
PLACES, ROUNDING = 12, 1e-9


def pulled_by_position(simulator: HostSimulator, joint: str) -> bool:
    """Whether a force on a joint at rest depends on where it is."""
    own = next(one for one in simulator.joints if one.name == joint)
    if own.first_order:
        return False
    scale = next(c.scale for c in simulator.state_channels if c.name == own.position)
    return bool(np.ptp(_after(simulator, joint, scale * np.array(ELSEWHERE))) > 0)


def pulled_by_turn(simulator: HostSimulator, joint: str) -> bool:
    """Whether a force on a joint that turns depends on more than how far it is, as a spring's does:
    so that it is pulled by its direction already."""
    own = next(one for one in simulator.joints if one.name == joint)
    turn = next(c.turn for c in simulator.state_channels if c.name == own.position)
    share = np.linspace(0.0, 1.0, PLACES + 1)
    after = _after(simulator, joint, share * (turn or 1.0))
    bent = after - (1 - share) * after[0] - share * after[-1]
    return not np.ptp(bent) <= ROUNDING * float(np.abs(after).max())


def _after(simulator: HostSimulator, joint: str, places: ArrayLike) -> Array:
    """The rate of a joint a step after rest at each of some places, (n,).

    All others are at zero; at their scales, if the motion is not defined there, as that of a load
    on a rope of no length.
    """
    plain = simulator.with_effects(())
    own = next(one for one in plain.joints if one.name == joint)
    names = [channel.name for channel in plain.state_channels]
    positions = {one.position for one in plain.joints}
    at_scales = [c.scale if c.name in positions else 0.0 for c in plain.state_channels]
    states = np.zeros((len(np.asarray(places)), len(names)))
    with np.errstate(all="ignore"):
        for others in (np.zeros(len(names)), np.array(at_scales)):
            states[:] = others
            states[:, names.index(own.position)] = places
            after = plain.step(states, np.zeros((len(states), len(plain.action_channels))))
            if np.isfinite(after).all():
                break
    return after[:, names.index(str(own.rate))]
