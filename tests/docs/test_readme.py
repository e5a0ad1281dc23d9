"""The README's Python example runs as written."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]


def test_the_example_runs_and_corrects_the_simulator():
    (example,) = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(), re.DOTALL)
    names = {}
    exec(example, names)
    corrected, pendulum = names["corrected"], names["Pendulum"]
    state, action = [[2.0, 3.0]], [[1.0]]
    truth = pendulum.true().step(state, action)
    error = abs(corrected.step(state, action) - truth).max()
    gap = abs(pendulum().step(state, action) - truth).max()
    assert error < 0.05 * gap
