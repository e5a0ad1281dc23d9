"""The report of one pendulum trial: verdict, pictures, tables."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure as Drawing

from sims.render import PendulumRenderer
from studies.learning.outcome import record_key
from studies.learning.records import (
    Results,
    accuracy_line,
    last_difference,
    load_rollouts,
    policies_section,
    policy_name,
    provenance,
)
from studies.reporting import (
    Animation,
    Figure,
    KeyValues,
    Prose,
    Report,
    Section,
    Table,
    Verdict,
)
from studies.reporting.figures import draw_over_time, new_figure, save_figure, styled
from studies.reporting.media import encode_gif

CONTROL_PERIOD = 0.05
TARGET = -1000.0  # the paper's fixed return (Table II)


def policy_table(results: Results) -> str:
    """The policies as text for the terminal."""
    rows = [
        {
            "policy": policy_name(record),
            "true samples": record["true_samples"],
            "seconds of truth": round(record["true_samples"] * CONTROL_PERIOD, 1),
            "return on the model": round(record["return_model"], 1),
            "return on the true system": round(record["return_true"], 1),
        }
        for record in results["policies"]
    ]
    lines = [pd.DataFrame(rows).to_string(index=False)]
    lines += [
        accuracy_line(record, record["visited"]["one_step"], 3) for record in results["accuracy"]
    ]
    return "\n".join(lines)


def write_report(results: Results, folder: Path) -> Path:
    """Figures as PNG with their numbers as CSV, and ``report.html``, into ``folder``.

    Args:
        results: What ``results.json`` holds.
        folder: The trial's folder, with ``rollouts/``.
    """
    rollouts = load_rollouts(results, folder)
    titles = {record_key(record): policy_name(record) for record in results["policies"]}
    figures = folder / "figures"
    sections: list[Section] = [verdict(results), tiles(results)]
    sections.append(
        Animation(
            film(rollouts, results),
            alt="Two pendulums: the idealised policy fails, the corrected one balances.",
            caption=f"First {FILM_SECONDS:.0f} s on the **true** pendulum: left the idealised "
            "policy, right the policy after the last update.",
            heading="Before and after",
        )
    )
    for heading, picture, alt, caption in (
        (
            "Trajectories on the true pendulum",
            trajectories(rollouts, titles, figures / "trajectories.png"),
            "Angle, rate and voltage over time for each policy on the true pendulum.",
            "Angle 0 is upright; every run starts hanging (paper, figure 6). Whole turns are kept.",
        ),
        (
            "Where the difference model is right",
            accuracy_figure(results, figures / "accuracy.png"),
            "One-step error along visited states beside that on uniformly random states.",
            "RMS error of one step over the RMS of the gap, along the first 2 s of fresh "
            "rollouts of the policy that was trained on this model, and on uniformly random "
            "states. 1 is as bad as no model.",
        ),
        (
            "Return by true samples",
            returns_figure(results, figures / "returns.png"),
            "Return on the true pendulum against the number of true samples.",
            "Higher is better; a hanging pendulum returns −19 739.",
        ),
    ):
        if picture:
            sections.append(Figure(picture, alt, caption, heading=heading))
    sections += [policies_section(results), accuracy_section(results), *provenance(results)]
    report = Report(
        "Pendulum: closing the simulation gap",
        f"{results['label']}, seed {results['seed']}",
        sections,
    )
    return report.write(folder / "report.html")


FILM_SECONDS = 6.0


def verdict(results: Results) -> Verdict:
    """Did it work, in one sentence?"""
    idealised = results["policies"][0]["return_true"]
    learnt = last_difference(results)
    if learnt is None:
        works = idealised >= TARGET
        return Verdict(
            f"Trained on the simulator alone, the policy returns {idealised:.0f} "
            "on the true pendulum.",
            tone="good" if works else "bad",
            label="works" if works else "fails",
        )
    after, samples = learnt["return_true"], learnt["true_samples"]
    seconds = samples * CONTROL_PERIOD
    if after >= TARGET:
        first = next(
            record
            for record in results["policies"]
            if record["name"] == "difference" and record["return_true"] >= TARGET
        )
        return Verdict(
            f"The policy works on the true pendulum: its return rose from {idealised:.0f} "
            f"to {after:.0f}.",
            f"It took {samples} true samples, {seconds:.0f} s of interaction; "
            f"{TARGET:.0f} was passed after {first['true_samples']}.",
            tone="good",
            label="gap closed",
        )
    return Verdict(
        f"The policy does not work on the true pendulum yet: its return went from "
        f"{idealised:.0f} to {after:.0f}, below {TARGET:.0f}.",
        f"After {samples} true samples ({seconds:.0f} s). More samples, another update or "
        "another estimator may close the rest; the accuracy below says where the model errs.",
        tone="bad",
        label="gap remains",
    )


def tiles(results: Results) -> KeyValues:
    """The headline numbers."""
    items: dict[str, Any] = {
        "idealised policy, return": f"{results['policies'][0]['return_true']:.0f}"
    }
    learnt = last_difference(results)
    if learnt:
        items["difference policy, return"] = f"{learnt['return_true']:.0f}"
        items["true interaction"] = f"{learnt['true_samples'] * CONTROL_PERIOD:.0f} s"
    if results["accuracy"]:
        one_step = results["accuracy"][-1]["visited"]["one_step"]
        items["one-step error, share of gap"] = f"{max(one_step.values()):.3f}"
    return KeyValues(items, style="tiles")


def film(rollouts: Mapping[str, dict[str, np.ndarray]], results: Results) -> bytes:
    """The idealised policy beside the last one on the true pendulum, as a GIF."""
    learnt = last_difference(results)
    pair = ["idealised", record_key(learnt)] if learnt else ["idealised"]
    steps = round(FILM_SECONDS / CONTROL_PERIOD)
    draw = PendulumRenderer().frame
    frames = [
        np.concatenate([draw(rollouts[name]["states"][k]) for name in pair], axis=1)
        for k in range(steps)
    ]
    return encode_gif(frames, CONTROL_PERIOD)


@styled()
def trajectories(
    rollouts: Mapping[str, dict[str, np.ndarray]], titles: Mapping[str, str], path: Path
) -> Drawing:
    """Angle, rate and voltage over the first seconds of every policy's episode."""
    figure, axes = new_figure(3, 1, height=6.0, share_x=True)
    steps = round(FILM_SECONDS / CONTROL_PERIOD)
    time = np.arange(steps) * CONTROL_PERIOD
    data: dict[str, np.ndarray] = {"time_s": time}
    rows = {}
    for key, column, label in (
        ("states", 0, "angle (rad)"),
        ("states", 1, "rate (rad/s)"),
        ("actions", 0, "voltage (V)"),
    ):
        series = {}
        for name, run in rollouts.items():
            values = run[key][:steps, column]
            if label.startswith("angle"):
                # The upright at which the run ends is angle 0: no jumps, whatever the turns.
                values = values - 2 * np.pi * np.round(values[-1] / (2 * np.pi))
            series[titles[name]] = (time, values)
            data[f"{name}_{label.split()[0]}"] = values
        rows[label] = series
    draw_over_time(figure, axes[:, 0], rows)
    save_figure(figure, path, data)
    return figure


@styled()
def accuracy_figure(results: Results, path: Path) -> Drawing | None:
    """One-step error per update, along visited and on uniformly random states."""
    if not results["accuracy"]:
        return None
    rows = [
        {
            "true_samples": record["true_samples"],
            "where": where,
            "channel": channel,
            "error": error,
        }
        for record in results["accuracy"]
        for where in ("visited", "uniform")
        for channel, error in record[where]["one_step"].items()
    ]
    table = pd.DataFrame(rows)
    channels = list(dict.fromkeys(table["channel"]))
    figure, axes = new_figure(1, len(channels), share_y=True)
    for axis, channel in zip(axes[0], channels, strict=True):
        for where, part in table[table["channel"] == channel].groupby("where", sort=False):
            axis.plot(part["true_samples"], part["error"], marker="o", label=where)
        axis.set(title=channel, xlabel="true samples", yscale="log")
        axis.set_xticks(sorted(set(table["true_samples"])))
    axes[0, 0].set_ylabel("one-step error / gap")
    axes[0, 0].legend()
    save_figure(figure, path, table)
    return figure


@styled()
def returns_figure(results: Results, path: Path) -> Drawing:
    """Loss (minus the return) on the true system against true samples."""
    figure, axes = new_figure()
    axis = axes[0, 0]
    rows = []
    loop = [r for r in results["policies"] if r["name"] in ("idealised", "difference")]
    series = {"difference model": [(r["true_samples"], -r["return_true"]) for r in loop]}
    for record in results["policies"]:
        if "curve" in record and record["name"] in ("cold", "warm"):
            series[policy_name(record)] = [(step, -value) for step, value in record["curve"]]
    for name, points in series.items():
        x, y = np.array(points, float).T
        axis.plot(x, y, marker="o" if len(x) < 12 else None, label=name)
        rows += [{"policy": name, "true_samples": a, "return": -b} for a, b in points]
    axis.axhline(-TARGET, color="#6e7781", linestyle=(0, (4, 3)), linewidth=1.2)
    axis.annotate("−1000, the paper's target", (0.99, -TARGET), xycoords=("axes fraction", "data"),
                  ha="right", va="bottom", fontsize=9)  # fmt: skip
    axis.set(xlabel="true samples", ylabel="minus the return", yscale="log")
    axis.legend()
    save_figure(figure, path, pd.DataFrame(rows))
    return figure


def accuracy_section(results: Results) -> Table | Prose:
    """All accuracy figures."""
    if not results["accuracy"]:
        return Prose("No difference model was learnt.", heading="Accuracy")
    rows = []
    for record in results["accuracy"]:
        for where in ("visited", "uniform"):
            measured = record[where]
            row = [record["iteration"], where, *measured["one_step"].values()]
            for errors in measured["multi_step"].values():
                row += list(errors.values())
            rows.append([*row, measured["coverage90"], record["fit_seconds"]])
    measured = results["accuracy"][0]["visited"]
    columns = ["update", "states", *(f"{name}, 1 step" for name in measured["one_step"])]
    for horizon, errors in measured["multi_step"].items():
        columns += [f"{name}, {horizon}" for name in errors]
    return Table(
        [*columns, "90 % coverage", "fit s"],
        rows,
        caption="Errors as shares of the gap without the model; coverage of the predicted 90 % "
        "interval.",
        heading="Accuracy",
    )
