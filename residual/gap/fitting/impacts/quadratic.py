"""Every set of effects at once, without a simulation: windows as quadratic functions of strengths.

With the free start states projected out, a window's squared residual is a quadratic function of
the strengths of all effects. The robust loss of any set of them is then minimised by a few
small weighted least squares, for thousands of sets at a time.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.fitting.impacts.robust import losses, weights

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True)
class Quadratic:
    """Squared residual of every window, ``c - 2 b d + d A d``, in the coefficients d.

    Attributes:
        a: shape (W, k, k).
        b: shape (W, k).
        c: shape (W,).
        freedom: Measured values less free states, (W,).
        low: Least value of every coefficient, (k,).
    """

    a: Array
    b: Array
    c: Array
    freedom: Array
    low: Array

    @classmethod
    def of(
        cls, by_start: Array, residual: Array, columns: Array, freedom: Array, low: Array
    ) -> Quadratic:
        """From the derivative by start states (W, R, f) and columns (W, R, k)."""
        basis, _ = np.linalg.qr(by_start)
        inner = basis.transpose(0, 2, 1)
        left = residual - (basis @ (inner @ residual[..., None]))[..., 0]
        columns = columns - basis @ (inner @ columns)
        turned = columns.transpose(0, 2, 1)
        return cls(
            turned @ columns, (turned @ left[..., None])[..., 0], (left**2).sum(axis=1), freedom,
            low,
        )  # fmt: skip

    def beside(self, residual: Array, columns: Array) -> Quadratic:
        """The same with as many further windows (W, R), (W, R, k), that have no start states."""
        turned = columns.transpose(0, 2, 1)
        return dataclasses.replace(
            self,
            a=np.concatenate([self.a, turned @ columns]),
            b=np.concatenate([self.b, (turned @ residual[..., None])[..., 0]]),
            c=np.append(self.c, (residual**2).sum(axis=1)),
            freedom=np.append(self.freedom, self.freedom),
        )

    def costs(self, coefficients: Array) -> Array:
        """Squared residuals at coefficients (k,), (W,)."""
        quadratic = np.einsum("wij,i,j->w", self.a, coefficients, coefficients)
        return np.maximum(self.c - 2 * self.b @ coefficients + quadratic, 0.0)

    def moved(self, coefficients: Array) -> Quadratic:
        """The same around other coefficients, (k,)."""
        gone = self.a @ coefficients
        return dataclasses.replace(
            self, b=self.b - gone, c=self.costs(coefficients), low=self.low - coefficients
        )


def minimise(
    model: Quadratic, sets: Sequence[tuple[int, ...]], turns: int = 8, chunk: int = 3000
) -> tuple[Array, Array]:
    """Least robust loss of many sets of columns of one size.

    Args:
        sets: Numbers of the columns that are free, all tuples of one length k.
        turns: Reweighted least squares.

    Returns:
        Loss of every set, (N,), and its coefficients, (N, k).
    """
    index = np.array(sets, np.int64).reshape(len(sets), -1)
    found = [_minimise(model, index[i : i + chunk], turns) for i in range(0, len(index), chunk)]
    return np.concatenate([f[0] for f in found]), np.concatenate([f[1] for f in found])


def _minimise(model: Quadratic, index: NDArray[np.int64], turns: int) -> tuple[Array, Array]:
    a = model.a[:, index[:, :, None], index[:, None, :]]
    b = model.b[:, index]
    low = model.low[index]
    freedom = model.freedom[:, None]
    k = index.shape[1]
    found = np.zeros(index.shape)
    cost = np.repeat(model.c[:, None], len(index), axis=1)
    for _ in range(turns):
        weight = weights(cost, freedom)
        matrix = np.einsum("wn,wnij->nij", weight, a)
        right = np.einsum("wn,wni->ni", weight, b)
        size = np.sqrt(np.maximum(np.einsum("nii->ni", matrix), 1e-12))
        scaled = matrix / (size[:, :, None] * size[:, None, :]) + 1e-9 * np.eye(k)
        found = np.linalg.solve(scaled, (right / size)[..., None])[..., 0] / size
        for _ in range(k):
            below = found < low
            if not below.any():
                break
            # Held at the bound, the others solved again.
            fixed = np.where(below, low, 0.0)
            held = right - (matrix @ fixed[..., None])[..., 0]
            free = scaled * ~(below[:, :, None] | below[:, None, :]) + below[:, :, None] * np.eye(k)
            again = np.linalg.solve(free, np.where(below, 0.0, held / size)[..., None])[..., 0]
            found = np.where(below, low, again / size)
        cost = model.c[:, None] - 2 * (b * found).sum(-1)
        cost = np.maximum(cost + np.einsum("wnij,ni,nj->wn", a, found, found), 0.0)
    return losses(cost, freedom).sum(axis=0), found
