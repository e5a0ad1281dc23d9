"""What a training takes over from those before it: the last networks, and what to replay."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any, Literal

ReplayRule = Literal["first", "all"]


@dataclasses.dataclass(frozen=True)
class Earlier:
    """The trainings on a simulator that came before one.

    Args:
        policy: Folder of the last one, whose networks are trained on.
        rule: What is learnt from again: ``"first"``, from the second update on, the replay of the
            first one, as it is (paper, section III-C); ``"all"``, from the first on, all that was
            simulated, relabelled with the newest difference model.
        trainings: Folders of the trainings that this concerns.
    """

    policy: Path
    rule: ReplayRule
    trainings: tuple[Path, ...] = ()

    @classmethod
    def begin(cls, idealised: Path, rule: ReplayRule) -> Earlier:
        """Before the first update."""
        return cls(idealised, rule, (idealised,) if rule == "all" else ())

    def then(self, policy: Path) -> Earlier:
        """After one more."""
        if self.rule == "first":
            return Earlier(policy, self.rule, self.trainings or (policy,))
        return Earlier(policy, self.rule, (*self.trainings, policy))

    def settings(self) -> dict[str, Any]:
        """What a training after these depends on, for its stage."""
        return {"policy": self.policy, "earlier": list(self.trainings)}
