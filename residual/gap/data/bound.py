"""Positions that are bound to each other, as in a closed chain, where a log lacks one of them."""

from __future__ import annotations

from collections.abc import Sequence

from residual.gap.data.inspection import measured
from residual.logs.checks import Finding
from residual.trajectories import Trajectory
from sims.host import HostSimulator


def bound(simulator: HostSimulator, trajectories: Sequence[Trajectory]) -> list[Finding]:
    """Positions that were not logged, though others that were leave them no choice: forecasts that
    begin off the bond are thrown about by it."""
    if not simulator.binds_positions:
        return []
    logged = {channel.name for channel, _ in measured(simulator, trajectories)}
    positions = [c.name for c in simulator.physical_channels if c.kind != "rate"]
    missing = [name for name in positions if name not in logged]
    if not missing:
        return []
    says = (
        f"the position {missing[0]} was not logged, and {simulator.name} binds positions to each "
        "other (<equality>): forecasts begin off that bond, which throws them about. Compute it "
        "from the others and add its column"
    )
    return [Finding("bound", missing[0], says, {"missing": len(missing)}, "warning")]
