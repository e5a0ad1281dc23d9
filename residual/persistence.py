"""Saving and loading estimators and difference models without pickle.

A file is one safetensors file: arrays by name, and one JSON document as metadata that holds the
format's version, the class (one of a fixed set) and its constructor arguments. Loading reads
numbers and text; nothing in the file is executed or imported. An estimator of another library,
or an ensemble, is one array of bytes in that file, which skops reads (``residual.foreign``).
"""

from __future__ import annotations

import dataclasses
import importlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sklearn.utils.validation import check_is_fitted

from residual.difference import DifferenceModel
from residual.estimator import Estimator
from residual.foreign import dumped, loaded
from simgap_files.arrays import FileError, read_arrays, write_arrays
from sims.simulator import Channel, Simulator

_CLASSES = {
    "DropoutNet": "residual.dropout_net",
    "GaussianProcess": "residual.gaussian_process",
    "Linear": "residual.linear",
    "NamedEffects": "residual.named_effects",
}
#: Where a class's arrays or arguments changed since its first files.
_FORMATS = {"DropoutNet": 2}
#: In place of a class: an estimator in skops' format.
_FOREIGN = "skops"
# Steps the simulator itself; not imported here, since it brings the whole search for effects.
_OF_SIMULATOR = "NamedEffects"
# Far more columns than any system has; a larger number in a file is damage.
_MOST_COLUMNS = 100_000


def save(model: Any, path: str | Path) -> None:
    """Write a fitted estimator, or a fitted difference model of one, to a file.

    The file appears complete or not at all.

    Args:
        model: A ``DropoutNet``, ``GaussianProcess``, ``Linear`` or ``NamedEffects``, any other
            scikit-learn regressor if skops is installed, or a ``DifferenceModel`` of one. The
            simulator of ``NamedEffects`` is not written.
        path: The file; by convention it ends in ``.safetensors``.

    Raises:
        TypeError: An argument of ours that is not a number, a text, None or a sequence of those,
            or an estimator that skops cannot write.
        sklearn.exceptions.NotFittedError: The estimator is not fitted.
    """
    header: dict[str, Any] = {}
    estimator: Any = model
    if isinstance(model, DifferenceModel):
        estimator = model.fitted()
        header["difference"] = {
            "dt": model.dt,
            "state_channels": [dataclasses.asdict(channel) for channel in model.state_channels],
            "action_channels": [dataclasses.asdict(channel) for channel in model.action_channels],
            "mean": model.mean_.tolist(),
            "scale": model.scale_.tolist(),
            "seen": model.seen_.tolist(),
            "parameters": _parameters(model.simulator),
        }
    name = type(estimator).__name__
    if not is_ours(estimator):
        check_is_fitted(estimator)
        write_arrays(path, header | {"class": _FOREIGN}, {_FOREIGN: dumped(estimator)})
        return
    header["class"], header["class_format"] = name, _FORMATS.get(name, 1)
    header["params"] = {
        key: _plain(f"{name}.{key}", value)
        for key, value in estimator.get_params(deep=False).items()
        if key != "simulator"
    }
    if name == _OF_SIMULATOR:
        header["values"] = estimator.state_values()
    names = getattr(estimator, "feature_names_in_", None)
    header["feature_names"] = None if names is None else [str(name) for name in names]
    write_arrays(path, header, estimator.state_arrays())


def is_ours(estimator: Any) -> bool:
    """Whether an estimator is of a class whose files need nothing but numbers and text."""
    return type(estimator).__module__ == _CLASSES.get(type(estimator).__name__)


def load(path: str | Path, simulator: Simulator | None = None, trusted: Sequence[str] = ()) -> Any:
    """Read what ``save`` wrote; no code is run from the file.

    Args:
        path: The file.
        simulator: For a difference model, the simulator to fit on again and to check against;
            without it the model predicts but cannot be fitted. ``NamedEffects`` need it to
            predict.
        trusted: For an estimator of another library: import paths of types, beside those that
            skops knows to be safe and ours, that the file may hold.

    Returns:
        The fitted ``DifferenceModel`` or estimator.

    Raises:
        FileNotFoundError: There is no such file.
        ValueError: The file is damaged, holds types that are not trusted, or is not one that
            ``save`` wrote, or the difference model in it was fitted for another control period,
            other channels or other parameters than those of ``simulator``.
    """
    header, arrays = read_arrays(path)
    try:
        # What divides by zero shows as a prediction that is not finite.
        with np.errstate(all="ignore"):
            model = _restore(header, arrays, simulator, trusted)
    except FileError as error:
        raise FileError(f"{path}: {error}") from None
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError, RecursionError,
            MemoryError) as error:  # fmt: skip
        reason = " ".join(f"{type(error).__name__}: {error}".split())
        raise FileError(
            f"{path} is damaged or was not written by residual.save ({reason:.300}): save the "
            "model again"
        ) from error
    if simulator is not None and isinstance(model, DifferenceModel):
        try:
            model.check_fits(simulator)
            _refuse_other_parameters(header["difference"].get("parameters"), simulator)
        except ValueError as error:
            raise FileError(f"{path}: {error}") from None
        model.simulator = simulator
    return model


def _parameters(simulator: Simulator | None) -> dict[str, float]:
    """The parameters of a simulator that are single numbers, as a difference adds to them."""
    known = getattr(simulator, "parameters", {})
    return {n: float(p.value) for n, p in known.items() if np.ndim(p.value) == 0}


def _refuse_other_parameters(fitted: Any, simulator: Simulator) -> None:
    """Refuse a simulator with other parameters than that of the fit: it would be corrected twice.

    Raises:
        ValueError: The message says which parameter, and what it was.
    """
    if not isinstance(fitted, dict):
        return  # an earlier version did not keep them
    for name, value in _parameters(simulator).items():
        was = fitted.get(name, value)
        if not isinstance(was, int | float):
            raise ValueError(f"parameter {name} is {was!r:.40}, expected a number")
        if not np.isclose(value, was, rtol=1e-9, atol=0.0):
            raise ValueError(
                f"the difference model was fitted beside {name} {was:g}, and the simulator has "
                f"{value:g}: what that changes would be added twice; load it with the simulator "
                "that it was fitted with, or fit again"
            )


def _restore(
    header: dict[str, Any],
    arrays: dict[str, NDArray],
    simulator: Simulator | None,
    trusted: Sequence[str],
) -> Any:
    name = header["class"]
    if name == _FOREIGN:
        return _difference(header, loaded(arrays[_FOREIGN], trusted))
    if name not in _CLASSES:
        raise FileError(f"holds a {name!r}; only {', '.join(_CLASSES)} can be loaded")
    if header.get("class_format", 1) != _FORMATS.get(name, 1):
        raise FileError(
            f"holds a {name} of format {header.get('class_format', 1)!r}, this release reads "
            f"{_FORMATS.get(name, 1)}: fit it again from its data and save it"
        )
    columns = arrays["n_features_in_"].item()
    if type(columns) is not int or not 1 <= columns <= _MOST_COLUMNS:
        raise ValueError(f"n_features_in_ is {columns}, expected 1 to {_MOST_COLUMNS}")
    params = {key: _tuples(value) for key, value in header["params"].items()}
    kind: type[Estimator] = getattr(importlib.import_module(_CLASSES[name]), name)
    estimator = kind.from_state(params, arrays)
    if name == _OF_SIMULATOR:
        if simulator is None:
            raise FileError("holds NamedEffects, which step the simulator: load(path, simulator)")
        estimator.restore(header["values"], simulator)
    names = header["feature_names"]
    if names is not None and ("difference" in header or len(names) != columns):
        raise ValueError(f"feature_names are {names!r:.60}, expected {columns} names or none")
    # Arrays that do not fit together show here, not in the middle of a study.
    mean, std = estimator.predict(np.zeros((1, estimator.n_features_in_)), return_std=True)
    if not (np.isfinite(mean).all() and np.isfinite(std).all()):
        raise ValueError("a prediction is not finite")
    if names is not None:
        estimator.feature_names_in_ = np.array([str(name) for name in names], dtype=object)
    return _difference(header, estimator)


def _difference(header: dict[str, Any], estimator: Any) -> Any:
    """The difference model that a header describes, or the estimator if it describes none."""
    if "difference" not in header:
        return estimator
    fields = header["difference"]
    model = DifferenceModel.from_state(
        estimator,
        float(fields["dt"]),
        tuple(map(_channel, fields["state_channels"])),
        tuple(map(_channel, fields["action_channels"])),
        np.array(fields["mean"], float),
        np.array(fields["scale"], float),
        _seen(fields),
    )
    model.predict(
        np.zeros((1, len(model.state_channels))), np.zeros((1, len(model.action_channels)))
    )
    return model


def _seen(fields: dict[str, Any]) -> NDArray | None:
    """Lowest and highest states of the data; files of earlier versions do not tell."""
    if "seen" not in fields:
        return None
    seen = np.array(fields["seen"], float)
    if seen.shape != (2, len(fields["state_channels"])) or not np.isfinite(seen).all():
        raise ValueError(f"seen has shape {seen.shape}, expected the lowest and highest states")
    return seen


def _channel(fields: dict[str, Any]) -> Channel:
    channel = Channel(**fields)
    names = (channel.name, channel.unit, channel.kind, channel.rate_of or "")
    numbers = (channel.scale, channel.low, channel.high)
    if not all(isinstance(name, str) for name in names) or not all(
        isinstance(number, int | float) for number in numbers
    ):
        raise TypeError(f"{channel!r:.100} is no channel")
    return channel


def _plain(name: str, value: Any) -> Any:
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, list | tuple | np.ndarray):
        return [_plain(name, item) for item in value]
    raise TypeError(
        f"{name} is a {type(value).__name__}, which a file cannot hold: "
        "use a number, a text, None or a sequence of those"
    )


def _tuples(value: Any) -> Any:
    return tuple(map(_tuples, value)) if isinstance(value, list) else value
