"""Estimators of other libraries in files, by skops: no code runs, unknown types are refused."""

from __future__ import annotations

import zipfile
from collections.abc import Sequence
from io import BytesIO
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simgap_files.arrays import FileError
from simgap_files.npz import check_unpacked

#: Ours that an ensemble or a pipeline may hold; each is plain numbers and arrays.
_OURS = (
    "residual.dropout_net.DropoutNet",
    "residual.ensemble.Ensemble",
    "residual.features.ChannelFeatures",
    "residual.gaussian_process.GaussianProcess",
    "residual.linear.Linear",
)
_WITH_SIMULATOR = "residual.named_effects.NamedEffects"


def dumped(estimator: Any) -> NDArray[np.uint8]:
    """A fitted estimator as bytes.

    Raises:
        TypeError: skops is not installed, or something inside has no file format but pickle.
    """
    name = f"{type(estimator).__module__}.{type(estimator).__name__}"
    try:
        from skops import io
    except ImportError:
        raise TypeError(
            f"cannot save a {name} without the package skops: `pip install skops` (extra `skops`)"
        ) from None
    try:
        data = io.dumps(estimator)
        unknown = io.get_untrusted_types(data=data)
    except Exception as error:
        raise TypeError(f"cannot save a {name}: {error}") from error
    if _WITH_SIMULATOR in unknown:
        raise TypeError(f"cannot save a {name} of NamedEffects: they hold a simulator")
    return np.frombuffer(data, np.uint8)


def loaded(data: NDArray[np.uint8], trusted: Sequence[str]) -> Any:
    """The estimator that ``dumped`` wrote.

    Args:
        data: The bytes.
        trusted: Import paths of types that may be made, beside scikit-learn's safe ones and ours.

    Raises:
        FileError: Other types are in it, or skops is not installed.
    """
    try:
        from skops import io
    except ImportError:
        raise FileError(
            "holds another library's estimator, which needs the package skops: "
            "`pip install skops` (extra `skops`)"
        ) from None
    content = np.asarray(data, np.uint8).tobytes()
    try:
        with zipfile.ZipFile(BytesIO(content)) as archive:
            unpacked = sum(entry.file_size for entry in archive.infolist())
    except zipfile.BadZipFile as error:
        raise FileError(f"holds an estimator that is damaged ({error})") from None
    check_unpacked("the estimator", unpacked, len(content))
    unknown = sorted(set(io.get_untrusted_types(data=content)) - {*_OURS, *trusted})
    if unknown:
        raise FileError(
            f"holds types that are not trusted: {', '.join(unknown)}; if you know where the file "
            f"comes from, load it with trusted={unknown!r}"
        )
    return io.loads(content, trusted=[*_OURS, *trusted])
