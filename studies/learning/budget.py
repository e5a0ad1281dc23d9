"""How much a study samples and trains."""

from __future__ import annotations

import dataclasses


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
            one.
    """

    true_samples: int = 3750
    iterations: int = 2
    idealised_steps: int = 20_000
    difference_steps: int = 20_000
    true_steps: int = 0
    baseline_steps: int = 0
    control_steps: int = 0
    corrected_steps: int = 20_000

    def __post_init__(self) -> None:
        for field in dataclasses.fields(self):
            least = 2 if field.name == "true_samples" else 0
            if (value := getattr(self, field.name)) < least:
                raise ValueError(f"{field.name} is {value}, expected at least {least}")
