"""What kind of file a policy or an agent is in, and that it is the kind asked for."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from simgap_files import arrays as sealed
from simgap_files.arrays import FileError


def write_arrays(
    path: str | Path, form: str, arrays: Mapping[str, NDArray[Any]], metadata: Mapping[str, Any]
) -> None:
    """Write a safetensors file, whole or not at all.

    Args:
        path: The file.
        form: What kind of file it is, for ``read_arrays``.
        arrays: By name.
        metadata: Values that JSON knows, by name.
    """
    sealed.write_arrays(path, {"format": form, **metadata}, arrays)


def read_arrays(path: str | Path, form: str) -> tuple[dict[str, Any], dict[str, Any]]:
    """Read a safetensors file: arrays by name, and the metadata, each value JSON.

    Args:
        path: The file.
        form: What its metadata has to say under ``format``.

    Raises:
        FileNotFoundError: There is no such file.
        OtherForm: It holds something else.
        ValueError: It is damaged, or not of this project.
    """
    metadata, arrays = sealed.read_arrays(path)
    if metadata.get("format") != form:
        raise OtherForm(
            f"{path} has format {metadata.get('format')!r}, expected {form!r}: agents are read by "
            "DDPG.load, policies by MlpPolicy.load, those of another algorithm by "
            "policy.Algorithm('stable_baselines3.SAC').load (on the command line --learner)"
        )
    return arrays, metadata


class OtherForm(FileError):
    """A whole file, but of another kind than was asked for."""


@contextlib.contextmanager
def content_of(path: str | Path, what: str) -> Iterator[None]:
    """Whatever does not fit in the content of a file is a ``FileError`` that names it."""
    try:
        yield
    except FileError:
        raise
    except (ValueError, LookupError, TypeError, AttributeError, ArithmeticError, MemoryError,
            RecursionError) as error:  # fmt: skip
        reason = f"it has no {error}" if isinstance(error, KeyError) else str(error)
        raise FileError(
            f"{path} is damaged or holds no {what} ({reason}): save it again"
        ) from error
