"""Pages that list fields and codes list all of them, as the code has them."""

import dataclasses
import re
from pathlib import Path

import numpy as np
import pytest

from residual.gap.answer.doubts import DOUBTS
from residual.gap.result import Gap, Verdict
from residual.logs import Column, LogFormat
from sims.simulator import Channel, Parameter

DOCS = Path(__file__).parents[2] / "docs"


def text(page):
    return (DOCS / page).read_text(encoding="utf-8")


def part(page, begin, end):
    """What stands between two lines of a page."""
    return text(page).split(begin)[1].split(end)[0]


def listed(table):
    """What stands in backticks in the first column of a table."""
    rows = [line.split("|")[1] for line in table.splitlines() if line.startswith("|")]
    return {name for row in rows for name in re.findall(r"`([^`]+)`", row)}


def fields(kind):
    return {field.name for field in dataclasses.fields(kind)}


@pytest.mark.parametrize(
    ("begin", "end", "kind"),
    [("**Of one column**", "**Of the files**", Column), ("**Of the files**", "**Free", LogFormat)],
)
def test_every_setting_of_a_log_is_listed(begin, end, kind):
    assert listed(part("logs.md", begin, end)) == fields(kind)


@pytest.mark.parametrize(
    ("begin", "end", "kind"),
    [("## Channels", "## Parameters", Channel), ("## Parameters", "## ", Parameter)],
)
def test_every_field_of_a_simulator_s_channels_and_parameters_is_listed(begin, end, kind):
    assert listed(part("simulators.md", begin, end)) == fields(kind)


def test_doubts_are_told_as_the_answer_tells_them():
    for code, says in DOUBTS.items():
        assert f"| `{code}` | {says} |" in text("gap-json.md")


@pytest.mark.parametrize(
    ("begin", "end", "kind"),
    [("## verdicts", "### doubts", Verdict), ("## gap\n", "\n## ", Gap)],
)
def test_every_field_of_gap_json_is_listed(begin, end, kind):
    names = listed(part("gap-json.md", begin, end))
    assert fields(kind) <= names


def test_a_column_map_from_python_reads_what_the_page_says(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    angle, lines = np.sin(np.arange(60) / 5), ["t,run,encoder,gyro,u"]
    rate = np.cos(np.arange(60) / 5) / 5 / 0.05
    for k in range(60):
        values = (50 * k, k // 30, np.degrees(angle[k]) - 180, -np.degrees(rate[k]), 900 * angle[k])
        lines.append(",".join(map(str, values)))
    Path("run.csv").write_text("\n".join(lines))
    (code,) = re.findall(r"```python\n(.*?)```", text("logs.md"), re.DOTALL)
    exec(code, names := {})
    first, second = names["logs"].trajectories
    assert np.allclose(first.states, np.stack([angle, rate], axis=1)[:30], atol=1e-6)
    assert len(second.times) == 30 and second.actions.max() <= 0.9


def test_the_rows_of_blind_logs_add_up_to_its_totals():
    lines = text("blind-logs.md").splitlines()
    cells = [[cell.strip(" *") for cell in line.split("|")[1:-1]] for line in lines]
    rows = [row[2:6] for row in cells if len(row) == 8 and row[2].isdigit()]
    *batches, total = ([int(cell or 0) for cell in row] for row in rows)
    assert [sum(column) for column in zip(*batches, strict=True)] == total
    logs, answers, wrong, size = total
    said = " ".join(lines)
    assert f"{answers} answers about {logs} logs. In {wrong} " in said and f"in {size} the" in said
    assert f"all {wrong}\n" in text("blind-logs.md") and f"all {size}\n" in text("blind-logs.md")
