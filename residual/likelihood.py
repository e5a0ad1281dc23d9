"""Hyperparameters of a Gaussian process of largest marginal likelihood, by gpytorch."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
from scipy.optimize import minimize

from residual.estimator import Array

# In units of the standardised data. The floor of the noise variance bounds the condition of the
# kernel matrix where a simulated system is observed without noise.
BOUNDS = {"lengthscale": (1e-2, 1e3), "outputscale": (1e-4, 1e4), "noise": (1e-10, 1e1)}


def maximise_likelihood(
    X: Array, y: Array, kernel: str, max_iter: int, least_noise: float = BOUNDS["noise"][0]
) -> tuple[Array, float, float, int]:
    """Length scales, signal and noise variance of largest marginal likelihood, and iterations.

    Args:
        X: standardised inputs, shape (n, n_in).
        y: one standardised target, shape (n,).
        kernel: ``"rbf"`` or ``"matern"``.
        max_iter: Most iterations of L-BFGS.
        least_noise: Lower bound of the noise variance.
    """
    import torch

    with warnings.catch_warnings():
        # It uses torch.jit.script, which warns that it is deprecated.
        warnings.simplefilter("ignore", DeprecationWarning)
        import gpytorch

    def tensors(rows: int) -> tuple[torch.Tensor, torch.Tensor]:
        return torch.from_numpy(X[:rows].copy()), torch.from_numpy(y[:rows].copy())

    inputs, targets = tensors(len(X))
    process = _process(inputs, targets, kernel)
    process.kernel.base_kernel.lengthscale = X.shape[1] ** 0.5
    process.kernel.outputscale = 1.0
    process.likelihood.noise = max(1e-2, least_noise)
    process.train()
    marginal = gpytorch.mlls.ExactMarginalLogLikelihood(process.likelihood, process)
    parameters = dict(process.named_parameters())
    sizes = [parameter.numel() for parameter in parameters.values()]
    limits = {**BOUNDS, "noise": (least_noise, BOUNDS["noise"][1])}
    bounds = [
        tuple(np.log(limits[name.rsplit("raw_", 1)[1]]))
        for name, size in zip(parameters, sizes, strict=True)
        for _ in range(size)
    ]

    def loss(values: Array) -> tuple[float, Array]:
        pieces = torch.from_numpy(values.copy()).split(sizes)
        with torch.no_grad():
            for parameter, piece in zip(parameters.values(), pieces, strict=True):
                parameter.copy_(piece.view_as(parameter))
        process.zero_grad()
        value = -marginal(process(inputs), targets)
        value.backward()
        return value.item(), torch.cat([p.grad.ravel() for p in parameters.values()]).numpy()

    best = torch.cat([p.detach().ravel() for p in parameters.values()]).numpy()
    iterations = 0
    with (
        gpytorch.settings.fast_computations(False, False, False),
        gpytorch.settings.max_cholesky_size(len(X) + 1),
        warnings.catch_warnings(),
    ):
        # gpytorch warns when it adds jitter on the way; the optimum is judged by its value.
        warnings.simplefilter("ignore")
        # A step costs the cube of the rows: most of the way is gone with a third of them.
        coarse = len(X) // 3
        for rows, share in ((coarse, 1), (len(X), 3)) if coarse >= 50 else ((len(X), 1),):
            inputs, targets = tensors(rows)
            process.set_train_data(inputs, targets, strict=False)
            found = minimize(
                loss,
                best,
                jac=True,
                bounds=bounds,
                method="L-BFGS-B",
                options={"maxiter": max(max_iter // share, 1)},
            )
            best = found.x
            iterations += found.nit
        loss(best)
    base = process.kernel.base_kernel
    return (
        base.lengthscale.detach().numpy().ravel().copy(),
        float(process.kernel.outputscale.item()),
        float(process.likelihood.noise.item()),
        max(int(iterations), 1),
    )


def _process(inputs: Any, targets: Any, kernel: str) -> Any:
    """An exact process of rows (n, n_in) and targets (n,), searched over logarithms."""
    import gpytorch
    import torch

    def positive() -> Any:
        return gpytorch.constraints.Positive(transform=torch.exp, inv_transform=torch.log)

    class Process(gpytorch.models.ExactGP):
        def __init__(self) -> None:
            likelihood = gpytorch.likelihoods.GaussianLikelihood(noise_constraint=positive())
            super().__init__(inputs, targets, likelihood)
            scales = {"ard_num_dims": inputs.shape[1], "lengthscale_constraint": positive()}
            base = (
                gpytorch.kernels.RBFKernel(**scales)
                if kernel == "rbf"
                else gpytorch.kernels.MaternKernel(nu=2.5, **scales)
            )
            self.kernel = gpytorch.kernels.ScaleKernel(base, outputscale_constraint=positive())
            self.mean = gpytorch.means.ZeroMean()

        def forward(self, x: Any) -> Any:
            return gpytorch.distributions.MultivariateNormal(self.mean(x), self.kernel(x))

    return Process().double()
