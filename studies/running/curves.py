"""Training curves for TensorBoard."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Iterator, Mapping
from pathlib import Path

from studies.running.progress import Advance


class Curves:
    """Progress that logs every number it is told, one run of TensorBoard for each step.

    Args:
        folder: For the runs, such as one trial's; a step that is run again gets another number.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    @contextlib.contextmanager
    def task(self, title: str, total: int) -> Iterator[Advance]:
        """A step; its folder is made with the first number."""
        from torch.utils.tensorboard import SummaryWriter

        name = re.sub(r"\W+", "-", title)
        with contextlib.ExitStack() as stack:
            writer: SummaryWriter | None = None

            def advance(
                done: int, note: str = "", values: Mapping[str, float] | None = None
            ) -> None:
                nonlocal writer
                if not values:
                    return
                if writer is None:
                    run = self.folder / f"{name}-{1 + len(list(self.folder.glob(f'{name}-*')))}"
                    writer = SummaryWriter(str(run))
                    stack.callback(writer.close)
                for key, value in values.items():
                    writer.add_scalar(key, value, done)

            yield advance
