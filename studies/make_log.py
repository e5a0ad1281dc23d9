"""Measure a system that hides something, for a first try of find_gap without a log of your own.

SciPy integrates the written-out equation of a pendulum with 0.090 kg instead of the 0.055 kg
that sims.pendulum.Pendulum believes in, and noise is added as sensors do. One CSV file per run.

  python -m studies.make_log --output logs
  python -m studies.find_gap --simulator sims.pendulum.Pendulum --logs logs/*.csv --output gap
  python -m studies.make_log --output logs --truth.mass 0 --truth.viscous_friction 1e-4

Or walks of the true Leo under a policy that studies.leo_gap learnt (docs/leo.md), simulated in
steps of a fifth of the simulator's; one CSV file per episode, cut at its fall.

  python -m studies.make_log --system leo --policy idealised.safetensors --output walks
  python -m studies.make_log --system leo --policy idealised.safetensors \
      --learner stable_baselines3.SAC --output walks
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

from jsonargparse.typing import NonNegativeInt, PositiveInt

from policy.learner import OURS, Algorithm
from residual.logs.writing import write_log
from sims.pendulum import ACTION_CHANNELS, IDEALISED_MASS, STATE_CHANNELS, TRUE_MASS
from studies.hidden.data import Truth, make_logs
from studies.hidden.walks import write_walks
from studies.running.command import Parser
from studies.running.ending import check_output, fail, guarded

HIDDEN = Truth(mass=TRUE_MASS / IDEALISED_MASS - 1)


def build_parser() -> Parser:
    """The command line."""
    parser = Parser(prog="python -m studies.make_log", description=__doc__)
    parser.add_argument("--output", type=Path, required=True, help="Folder for the CSV files.")
    parser.add_argument(
        "--system", choices=("pendulum", "leo"), default="pendulum", help="What is measured."
    )
    parser.add_argument(
        "--policy", type=str, help="Leo: a policy that walks, a file or an import path."
    )
    parser.add_argument(
        "--learner", default=OURS, help="Leo: the algorithm that learnt it, as leo_gap's --learner."
    )
    parser.add_argument("--learner_options", type=dict[str, Any], default={}, help="As leo_gap's.")
    parser.add_argument("--seed", type=NonNegativeInt, default=0, help="Of motion and noise.")
    parser.add_function_arguments(write_logs, skip={"folder", "seed"})
    parser.add_function_arguments(write_walks, "walk", skip={"folder", "policy", "learner", "seed"})
    return parser


def write_logs(
    folder: Path,
    truth: Truth = HIDDEN,
    noise: Literal["A", "B", "C"] = "A",
    excitation: Literal["strong", "weak", "policy"] = "strong",
    runs: PositiveInt = 15,
    steps: PositiveInt = 250,
    seed: int = 0,
) -> list[Path]:
    """Write the measured runs as CSV files with columns time, angle, rate and voltage.

    Args:
        folder: Where to.
        truth: What is hidden; mass, inertia, length and actuator_gain are relative changes.
        noise: A: 0.01 rad and 0.2 rad/s; B: angle rounded to 0.002 rad, no rate; C: 0.01 rad, no
            rate.
        excitation: Random voltages up to 3 V, up to 0.8 V, or a swing-up controller.
        runs: Number of files.
        steps: Control steps of 0.05 s in each.
        seed: Of motion and noise.

    Returns:
        The files.
    """
    paths = []
    for number, run in enumerate(make_logs(truth, seed, excitation, noise, runs, steps), start=1):
        paths.append(folder / f"run-{number:02d}.csv")
        write_log(paths[-1], run, STATE_CHANNELS, ACTION_CHANNELS)
    return paths


@guarded(resumes=False)
def main(arguments: Sequence[str] | None = None) -> None:
    """The command."""
    parser = build_parser()
    given = parser.instantiate(parser.parse_args(arguments))
    folder, system, policy = given.pop("output"), given.pop("system"), given.pop("policy")
    walk, seed = given.pop("walk"), given.pop("seed")
    learner, options = given.pop("learner"), given.pop("learner_options")
    check_output(folder)
    if system == "pendulum":
        paths = write_logs(folder, **vars(given), seed=seed)
    elif policy is None:
        fail("--system leo needs --policy, an agent that walks (docs/leo.md)")
    else:
        algorithm = None if learner == OURS else Algorithm(learner, options=options)
        paths = write_walks(folder, policy, algorithm, **vars(walk), seed=seed)
    print(f"{len(paths)} runs: {paths[0]} to {paths[-1].name}")


if __name__ == "__main__":
    main()
