"""The settings of a study: as options, as plain values, and as the trial that they describe."""

from __future__ import annotations

import copy
from pathlib import Path
from typing import Any

from jsonargparse.typing import NonNegativeFloat

from studies.learning.study import Config, Study, Trial
from studies.running.command import Parser
from studies.running.trials import Execution

#: Settings under their earlier names.
ALIASES = {"caution": "uncertainty_penalty"}


def build_parser(study: Study) -> Parser:
    """The command line of a study."""
    parser = Parser(prog=f"python -m studies.{study.name}", description=study.description)
    parser.add_argument("--config", action="config", help="YAML file with any of the settings.")
    parser.add_argument(
        "--output",
        type=Path | None,
        default=None,
        help=f"Folder for the results; default: results/{study.name}/ and a name.",
    )
    parser.add_class_arguments(Execution)
    parser.add_argument(
        "--grid",
        type=list[dict[str, list[Any]]] | None,
        default=None,
        help="For config files: blocks of settings and the values they take; one trial for each "
        "combination within a block.",
    )
    penalty = "uncertainty_penalty"
    parser.add_class_arguments(study.trial, sub_configs=True, skip={penalty})
    parser.add_argument(
        f"--{penalty}",
        "--caution",
        type=NonNegativeFloat,
        default=0.0,
        help="Reward lost per step, on the corrected simulator, for each multiple of the "
        "difference model's typical standard deviation; 0 learns as in the paper.",
    )
    parser.set_defaults(estimator={"class_path": study.estimator})
    return parser


def instantiate(study: Study, config: Config) -> Trial:
    """The trial that plain settings describe; exits with one line if they are wrong."""
    parser = build_parser(study)
    # The parser changes nested lists of what it is given.
    chosen = parser.instantiate(parser.parse_object(copy.deepcopy(dict(config))))
    return study.trial(**{name: chosen[name] for name in study.settings})


def resolve(study: Study, config: Config) -> dict[str, Any]:
    """``config`` with every default filled in, checked by the parser."""
    parser = build_parser(study)
    chosen = parser.parse_object(copy.deepcopy(dict(config)))
    settings = parser.plain(chosen)
    return {name: settings[name] for name in study.settings}


def trial_label(config: Config) -> str:
    """A readable name for a trial's folder."""
    estimator = config["estimator"]["class_path"].rsplit(".", 1)[-1]
    name = f"{estimator}-{config['budget']['true_samples']}-seed{config['seed']}"
    # One file may hold several systems: arm.SYSTEM and arm.LAGGED.
    system = ".".join(str(config.get("system") or "").split(".")[-2:])
    return f"{system}-{name}" if system else name
