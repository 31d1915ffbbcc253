"""`mapspeak doctor`: what a robot offers, and what to start before it can be used."""

import json
import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import anyio
import click

from mapspeak.cli.guarding import control_folder
from mapspeak.cli.options import ROBOT_OPTIONS, add_options
from mapspeak.cli.robots import RobotChoice, open_robot
from mapspeak.hold import Hold

if TYPE_CHECKING:
    from mapspeak.cli.checkup import Finding

SIGNS = {"fine": "ok", "doubtful": "??", "missing": "--"}


@click.command()
@add_options(ROBOT_OPTIONS)
@click.option("--json", "as_json", is_flag=True, help="The findings as JSON.")
def doctor(
    robot: str,
    robot_file: Path | None,
    ca_file: Path | None,
    seed: int,
    as_json: bool,  # noqa: FBT001 - a flag
) -> None:
    """Check a robot: what was found, how fresh it is, what is missing and how to start it.

    Ends with 0 when all is well, with 1 when something is missing, with 2 when it cannot be
    reached.
    """
    choice = RobotChoice(robot=robot, robot_file=robot_file, ca_file=ca_file, seed=seed)
    findings = anyio.run(examine_choice, choice)
    if as_json:
        click.echo(json.dumps([asdict(finding) for finding in findings], indent=2))
    else:
        _show(findings)
    sys.exit(1 if any(finding.health == "missing" for finding in findings) else 0)


async def examine_choice(choice: RobotChoice) -> "list[Finding]":
    """Return what the robot offers, once all of it has been found, and what it really gives."""
    from mapspeak.cli.checkup import describe_profile, examine  # noqa: PLC0415 - heavy
    from mapspeak.ros.port import LinkKind  # noqa: PLC0415
    from mapspeak.ros.robot import RosRobot  # noqa: PLC0415 - heavy; help must be quick

    async with open_robot(choice) as robot:
        if not isinstance(robot, RosRobot):
            return [*await examine(robot)]
        await robot.settle()
        found = await examine(robot)
        link = robot.connection.link
        is_second_choice = choice.robot.startswith("ros2") and link.kind is LinkKind.DDS
        reason = "because this Python has no rclpy" if is_second_choice else ""
        lines = describe_profile(robot.profile, link, reason=reason, map_age_s=robot.map_age_s)
        return [*lines, *find_servers(choice), *found]


def find_servers(choice: RobotChoice) -> "list[Finding]":
    """Return which servers of this user drive the same robot; nothing where none does."""
    from mapspeak.cli.checkup import Finding, Health  # noqa: PLC0415 - heavy; help must be quick

    processes = Hold(control_folder(None)).servers_of(choice.address)
    if not processes:
        return []
    if len(processes) == 1:
        said = f"1 serves this robot: process {processes[0]}"
        return [Finding(what="servers", health=Health.FINE, said=said)]
    said = f"{len(processes)} serve this robot: processes {', '.join(map(str, processes))}"
    hint = "Their goals replace each other and their velocities alternate: end all but one."
    return [Finding(what="servers", health=Health.DOUBTFUL, said=said, hint=hint)]


def _show(findings: "Sequence[Finding]") -> None:
    for finding in findings:
        click.echo(f"{SIGNS[finding.health]}  {finding.what}: {finding.said}")
        if finding.hint:
            click.echo(f"      {finding.hint}")
    n_missing = sum(finding.health == "missing" for finding in findings)
    n_doubtful = sum(finding.health == "doubtful" for finding in findings)
    click.echo(f"{n_missing} missing, {n_doubtful} doubtful, {len(findings)} looked at.")
