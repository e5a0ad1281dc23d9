"""Forward and backward through two rectified layers and a linear one, compiled.

A batch is a matrix with one column per transition: a product is fastest if its result's rows are
long and a multiple of the vector length, and batches usually are, widths like 300 or 6 not.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from policy.compiled import compiled
from policy.memory import zeros

Array = NDArray[np.float32]


class Weights(NamedTuple):
    """Views into the flat parameters of a network, or into its flat gradient.

    ``entry`` (inputs, h_1) is the first layer transposed, its bias being the row of a constant
    input; ``weight2`` (h_2, h_1 + late), ``bias2`` (h_2,), ``weight3`` (outputs, h_2), ``bias3``
    (outputs,). ``late`` inputs enter beside the first layer's output.
    """

    entry: Array
    weight2: Array
    bias2: Array
    weight3: Array
    bias3: Array

    @classmethod
    def of(
        cls, flat: Array, inputs: int, hidden: tuple[int, int], outputs: int, late: int
    ) -> Weights:
        """Views into an array of ``size`` elements."""
        first, second = hidden
        shapes = [(inputs, first), (second, first + late), (second,), (outputs, second), (outputs,)]
        ends = np.cumsum([np.prod(shape) for shape in shapes])
        parts = np.split(flat, ends[:-1])
        return cls(*(part.reshape(shape) for part, shape in zip(parts, shapes, strict=True)))

    @staticmethod
    def size(inputs: int, hidden: tuple[int, int], outputs: int, late: int) -> int:
        """Number of parameters."""
        first, second = hidden
        return inputs * first + (first + late + 1) * second + (second + 1) * outputs


class Buffers(NamedTuple):
    """What passes over n columns write: layers (width, n), and the gradients that reach them.

    Late inputs are the last rows of ``hidden1``, to be filled before a pass forward, and their
    gradients those of ``back1``.
    """

    hidden1: Array
    hidden2: Array
    output: Array
    back1: Array
    back2: Array

    @classmethod
    def empty(cls, hidden: tuple[int, int], outputs: int, columns: int, late: int) -> Buffers:
        """Memory for passes over ``columns`` columns."""
        layers = (hidden[0] + late, hidden[1])
        widths = (*layers, outputs, *layers)
        return cls(*(zeros(width, columns) for width in widths))


@compiled
def forward(w: Weights, inputs: Array, b: Buffers) -> None:
    """From inputs, shape (inputs, n), to ``b.output``."""
    first = b.hidden1[: w.entry.shape[1]]
    np.dot(w.entry.T, inputs, first)
    _rectify(first)
    np.dot(w.weight2, b.hidden1, b.hidden2)
    _add(b.hidden2, w.bias2)
    _rectify(b.hidden2)
    np.dot(w.weight3, b.hidden2, b.output)
    _add(b.output, w.bias3)


@compiled
def backward(w: Weights, d_output: Array, b: Buffers) -> None:
    """From the output's gradient, shape (outputs, n), to ``b.back2`` and ``b.back1``."""
    np.dot(w.weight3.T, d_output, b.back2)
    _through_rectifier(b.back2, b.hidden2)
    np.dot(w.weight2.T, b.back2, b.back1)
    width = w.entry.shape[1]
    _through_rectifier(b.back1[:width], b.hidden1[:width])


@compiled
def weight_gradients(gradient: Weights, inputs: Array, d_output: Array, b: Buffers) -> None:
    """Fill ``gradient`` after ``forward`` and ``backward``."""
    np.dot(d_output, b.hidden2.T, gradient.weight3)
    _row_sums(d_output, gradient.bias3)
    np.dot(b.back2, b.hidden1.T, gradient.weight2)
    _row_sums(b.back2, gradient.bias2)
    np.dot(inputs, b.back1[: gradient.entry.shape[1]].T, gradient.entry)


@compiled
def product(left: Array, right: Array, out: Array) -> None:
    """``out = left @ right``."""
    np.dot(left, right, out)


@compiled
def _add(values: Array, bias: Array) -> None:
    for i in range(values.shape[0]):
        for j in range(values.shape[1]):
            values[i, j] += bias[i]


@compiled
def _rectify(values: Array) -> None:
    flat = values.reshape(-1)
    for i in range(flat.size):
        flat[i] = np.float32(0) if flat[i] < 0 else flat[i]  # NaN stays


@compiled
def _through_rectifier(gradient: Array, output: Array) -> None:
    flat, rectified = gradient.reshape(-1), output.reshape(-1)
    for i in range(flat.size):
        flat[i] = flat[i] if rectified[i] > 0 else np.float32(0)


@compiled
def _row_sums(values: Array, sums: Array) -> None:
    for i in range(values.shape[0]):
        total = np.float32(0)
        for j in range(values.shape[1]):
            total += values[i, j]
        sums[i] = total
