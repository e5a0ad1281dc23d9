"""Ask find_gap about nine measured rigs and judge its answers by their keys.

The logs are not part of this project (docs/real-rigs.md says where they come from). find_gap sees
what the rig's config in studies/configs/find_gap says, and the logs to fit. Its corrected.yaml is
then judged on logs that it has not seen, beside the nominal simulator and beside a repair by hand:
the nominal simulator with the effects of the rig's answer key, fitted by the same forecasts.

  python -m studies.real_rigs --data rigs
  python -m studies.real_rigs --data rigs --rigs airtrack heater --output results/rigs
"""

from __future__ import annotations

import sys
import time
import traceback
from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from simgap_files.atomic import atomic_write_json, atomic_write_text
from studies.real.judge import Judged, ask
from studies.real.rigs import RIGS
from studies.reporting.markdown import frame_markdown
from studies.running.command import Parser
from studies.running.ending import check_output, fail, guarded

#: What a corrected simulator's error may be, in errors of the repair by hand, and processor
#: time in s.
RATIO, SECONDS = 1.5, 120.0


def build_parser() -> Parser:
    """The command line of this study."""
    parser = Parser(prog="python -m studies.real_rigs", description=__doc__)
    parser.add_argument(
        "--data",
        type=Path,
        required=True,
        help="Folder with one folder for each rig; docs/real-rigs.md lists their files.",
    )
    parser.add_argument(
        "--rigs", type=str, nargs="+", default=None, help="Only these, by folder; default: all."
    )
    parser.add_argument(
        "--output", type=Path, default=Path("results/real_rigs"), help="Folder for all answers."
    )
    return parser


def table(results: Sequence[Judged]) -> pd.DataFrame:
    """One row for each rig."""
    rows = []
    for found in results:
        names = ", ".join(found.named.right)
        if found.named.wrong:
            names += f"; WRONG: {', '.join(found.named.wrong)}"
        rows.append(
            {
                "rig": found.rig,
                "key named": names,
                "nominal": _errors(found.nominal),
                "corrected": _errors(found.corrected),
                "key's repair": _errors(found.repaired),
                "ratio": f"{found.ratio:.2f}",
                "s": f"{found.seconds:.0f}",
                "verdicts": "; ".join(found.said),
            }
        )
    return pd.DataFrame(rows)


def summary(results: Sequence[Judged]) -> str:
    """What was reached, in counts, and every miss in words."""
    counts = {
        "key's effect or its family named": sum(r.named.enough for r in results),
        f"error at most {RATIO} times the key's repair": sum(r.ratio <= RATIO for r in results),
        "a confirmed name that the key does not support": sum(bool(r.named.wrong) for r in results),
        f"at most {SECONDS:.0f} s of processor time": sum(r.seconds <= SECONDS for r in results),
    }
    lines = [f"{what}: {count}/{len(results)}" for what, count in counts.items()]
    for r in results:
        misses = {
            f"names {', '.join(r.named.right)}": not r.named.enough,
            f"{r.ratio:.2f} times the error of the key's repair": r.ratio > RATIO,
            f"confirmed {', '.join(r.named.wrong)}": bool(r.named.wrong),
            f"{r.seconds:.0f} s of processor time": r.seconds > SECONDS,
        }
        lines += [f"missed: {r.rig}: {what}" for what, missed in misses.items() if missed]
    return "\n".join(lines)


@guarded(resumes=False)
def main(arguments: Sequence[str] | None = None) -> None:
    """The command."""
    given = build_parser().parse_args(arguments)
    known = {rig.folder: rig for rig in RIGS}
    unknown = [name for name in given.rigs or [] if name not in known]
    if unknown:
        fail(f"--rigs: there is no rig {unknown[0]!r}; there are {', '.join(known)}")
    wanted = [known[name] for name in given.rigs or known]
    for rig in wanted:
        if not (given.data / rig.folder).is_dir():
            fail(f"--data {given.data}: no folder {rig.folder}, expected the rig's logs there")
    check_output(given.output)
    results, failed = [], []
    for rig in wanted:
        begin = time.perf_counter()

        def tell(text: str, rig: str = rig.folder, begin: float = begin) -> None:
            spent = time.perf_counter() - begin
            print(f"{rig} {spent:6.1f} s  {text}", file=sys.stderr, flush=True)

        try:
            found = ask(rig, given.data, given.output / rig.name, tell)
        except Exception:  # one rig that cannot be asked must not cost the others
            failed.append(rig.folder)
            print(f"{rig.folder} failed:\n{traceback.format_exc()}", file=sys.stderr)
            continue
        results.append(found)
        atomic_write_json(given.output / rig.name / "judged.json", found)
        print("\n".join(f"{rig.folder}: {line}" for line in (*found.said, *found.repair)))
    if results:
        made = table(results)
        atomic_write_text(given.output / "rigs.md", frame_markdown(made))
        print(f"\n{made.drop(columns='verdicts').to_string(index=False)}\n\n{summary(results)}")
        print(f"\ntable: {given.output / 'rigs.md'}")
    if failed:
        print(f"failed: {', '.join(failed)}", file=sys.stderr)
        raise SystemExit(1)


def _errors(errors: dict[str, float]) -> str:
    return ", ".join(f"{value:.3g}" for value in errors.values())


if __name__ == "__main__":
    main()
