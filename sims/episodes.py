"""Whether episodes of a true system are long enough to learn anything from."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sims.simulator import Array, Simulator
from sims.unsound import Unsound

#: Episodes from which on it is no accident that they end at once.
SEVERAL = 5


def refuse_ended_at_once(
    what: str, nominal: Simulator, rollouts: Sequence[tuple[Array, Array]]
) -> None:
    """Refuse a true system whose episodes mostly end with their first step.

    It begins where the task, or the environment itself, ends an episode; of single steps neither
    the difference nor a policy can be learnt.

    Args:
        what: Whose episodes, in words.
        nominal: Its channels name the columns of the states.
        rollouts: States (T + 1, n_s) and actions (T, n_a) of each.

    Raises:
        Unsound: The message tells the state in which one ended.
    """
    single = [states[-1] for states, actions in rollouts if len(actions) == 1]
    if len(rollouts) < SEVERAL or len(single) <= len(rollouts) / 2:
        return
    at = ", ".join(
        f"{c.name} {value:.4g}{c.unit_text}"
        for c, value in zip(nominal.state_channels, np.asarray(single[0]), strict=True)
    )
    raise Unsound(
        f"{what} ended {len(single)} of {len(rollouts)} episodes after one step, such as at {at}: "
        "it begins where the task or the environment ends an episode; change where it begins, or "
        "what terminal() says"
    )
