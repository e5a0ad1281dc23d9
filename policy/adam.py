"""Adam on one flat parameter tensor."""

from __future__ import annotations

import torch


class Adam:
    """Adam (Kingma and Ba, 2015) with torch's defaults, as one fused call without its bookkeeping.

    Args:
        parameters: Flat tensor, changed in place by ``step``.
        gradient: Its gradient, same shape, read by ``step``.
        learning_rate: Step size.
        weight_decay: Factor of the parameters added to the gradient: the gradient of
            ``weight_decay / 2 |parameters|^2``.
    """

    def __init__(
        self,
        parameters: torch.Tensor,
        gradient: torch.Tensor,
        learning_rate: float,
        weight_decay: float = 0.0,
    ) -> None:
        self.learning_rate = learning_rate
        self.weight_decay = weight_decay
        self.mean = torch.zeros_like(parameters)
        self.square = torch.zeros_like(parameters)
        self.steps = torch.zeros(())
        self._one = torch.ones(())  # adding a Python number would make a tensor of it each time
        self._parameters = parameters
        self._gradient = gradient

    def step(self) -> None:
        """Move the parameters once against the gradient."""
        self.steps.add_(self._one)
        torch._fused_adam_(
            [self._parameters],
            [self._gradient],
            [self.mean],
            [self.square],
            [],
            [self.steps],
            lr=self.learning_rate,
            beta1=0.9,
            beta2=0.999,
            weight_decay=self.weight_decay,
            eps=1e-8,
            amsgrad=False,
            maximize=False,
        )

    def reset(self) -> None:
        """Forget both moments and the step count."""
        for tensor in self.state().values():
            tensor.zero_()

    def state(self) -> dict[str, torch.Tensor]:
        """The tensors that make up the optimiser's memory, not copied."""
        return {"mean": self.mean, "square": self.square, "steps": self.steps}
