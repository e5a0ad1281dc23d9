"""How far the Pymunk Leo is from the reference after one control step: the table of docs/leo.md.

Run with ``OMP_NUM_THREADS=1 python tests/sims/leo_accuracy.py``; it takes about a minute.
"""

import dataclasses

import leo_reference as reference
import numpy as np
from leo_rows import flying, struggling, walking

from sims.leo import Leo


def main():
    stopped = reference.System(stops=True)
    cases = {
        "in the air": (Leo(), reference.System(), flying(200)),
        "struggling after a start": (Leo(), reference.System(), struggling(Leo(), 200)),
        "walking": (Leo(stops=True), stopped, walking()),
        "walking, true": (
            Leo.true(stops=True),
            dataclasses.replace(reference.TRUE, stops=True),
            walking(),
        ),
        "walking, friction of the ground 1": (
            Leo(stops=True).with_parameters(ground_friction=1.0),
            dataclasses.replace(stopped, ground_friction=1.0),
            walking(),
        ),
    }
    print("| states | rows | moved, median | position | 95 % | rate | 95 % |")
    print("|---|---|---|---|---|---|---|")
    for name, (leo, system, (states, actions)) in cases.items():
        wanted = reference.step(states, actions, system, h=2e-4)
        error = np.abs(leo.step(states, actions) - wanted)
        moved = np.abs(wanted - states)[:, :9].max(axis=1)
        position, rate = error[:, :9].max(axis=1), error[:, 9:].max(axis=1)
        row = (
            np.median(moved),
            *np.quantile(position, (0.5, 0.95)),
            *np.quantile(rate, (0.5, 0.95)),
        )
        print(f"| {name} | {len(states)} | " + " | ".join(f"{x:.2g}" for x in row) + " |")


if __name__ == "__main__":
    main()
