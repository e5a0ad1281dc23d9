"""How much a study samples and trains."""

from __future__ import annotations

import dataclasses

from policy.learner import Algorithm


@dataclasses.dataclass(frozen=True)
class Budget:
    """How much is sampled and trained.

    Args:
        true_samples: True transitions collected before each update of the difference model.
        iterations: Updates of the difference model.
        idealised_steps: Simulated steps that train the idealised policy.
        difference_steps: Simulated steps on the corrected simulator after each update.
        true_steps: True steps that train the reference policy on the true system; 0 skips it.
        baseline_steps: True steps given to the cold and to the warm start; 0 skips them.
        control_steps: Simulated steps of the control for each update; 0 skips it.
        corrected_steps: Simulated steps on the simulator that was corrected by name, if there is
            one; by default as many as ``difference_steps``.

    Raises:
        ValueError: A number is too small.
    """

    true_samples: int = 3750
    iterations: int = 2
    idealised_steps: int = 20_000
    difference_steps: int = 20_000
    true_steps: int = 0
    baseline_steps: int = 0
    control_steps: int = 0
    corrected_steps: int | None = None

    def __post_init__(self) -> None:
        for field in dataclasses.fields(self):
            least = 2 if field.name == "true_samples" else 0
            value = getattr(self, field.name)
            if value is None:
                continue
            whole = isinstance(value, int) and not isinstance(value, bool)
            if not whole or value < least:
                raise ValueError(
                    f"budget.{field.name} is {value!r}, expected a whole number from {least}"
                )

    @property
    def steps_on_corrected(self) -> int:
        """Simulated steps on the simulator that was corrected by name."""
        return self.difference_steps if self.corrected_steps is None else self.corrected_steps

    def check(self, algorithm: Algorithm, replay_is_filled: bool, corrected: bool = False) -> None:
        """Raise ``ValueError`` if a training would end before anything is learnt in it.

        Args:
            algorithm: Learns nothing before its warm-up is over.
            replay_is_filled: Whether trainings after the first begin with a full replay.
            corrected: Whether there is a simulator that was corrected by name.
        """
        empty = ["idealised_steps", "true_steps", "baseline_steps"]
        if not replay_is_filled:
            empty += ["difference_steps"] if self.iterations else []
            empty += ["control_steps"] + ["corrected_steps"] * corrected
        for name in empty:
            if 0 < (getattr(self, name) or 0) < algorithm.warm_up:
                raise ValueError(
                    f"budget.{name} is {getattr(self, name)}, but the first {algorithm.warm_up} "
                    "steps only fill the replay and teach nothing: give more steps, or a smaller "
                    + ("ddpg.warm_up" if algorithm.path == "policy.DDPG" else "learning_starts")
                )
