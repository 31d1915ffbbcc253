"""One trial from its setting to its score; every turn and picture is written at once."""

import time
from collections.abc import Callable
from contextlib import closing
from dataclasses import replace
from itertools import starmap
from pathlib import Path

import anyio
import cv2

from mapspeak.errors import ConfigError
from mapspeak.evaluation.agent import (
    Agent,
    AgentEnd,
    Assignment,
    OutOfBudgetError,
    Picture,
    ServerAccess,
    ToolClient,
    Witness,
)
from mapspeak.evaluation.agents.catalogue import find_agent
from mapspeak.evaluation.runs.workplace import CONTROL, TrialSetup, open_workplace
from mapspeak.evaluation.scores.groundtruth import GroundTruth
from mapspeak.evaluation.scores.judging import PICTURING, Evidence
from mapspeak.evaluation.tasks.catalogue import find_task
from mapspeak.evaluation.trials import (
    MAP,
    MEMORY,
    PICTURES,
    STATES,
    TURNS,
    Limits,
    Score,
    Setting,
    ToolCall,
    Trial,
    TrialResult,
    TrialState,
    Turn,
    trial_folder,
    turn_line,
    write_result,
)
from mapspeak.geometry import Point
from mapspeak.simulator import StateRecord, World, read_state_log
from mapspeak.spatial.mapfiles import load_map


class Transcript(Witness):
    """The witness of one trial, which enforces its limits and writes its conversation.

    Args:
        limits: What it may cost; wall time is watched from outside.
        look: Return how the simulation truly stands.
    """

    def __init__(
        self,
        folder: Path,
        limits: Limits,
        look: Callable[[], StateRecord],
        on_turn: Callable[[Turn], None] | None,
    ) -> None:
        self.n_turns = 0
        self.n_errors = 0
        self.calls: list[ToolCall] = []
        self.pictured_at: Point | None = None
        self._limits = limits
        self._look = look
        self._on_turn = on_turn
        self._begun_s = time.perf_counter()
        self._pictures = folder / PICTURES
        self._turns = (folder / TURNS).open("wb")

    def hear(self, turn: Turn, pictures: tuple[Picture, ...] = ()) -> None:
        """Write a turn with the robot's pose at that time, and keep its pictures.

        Raises:
            OutOfBudgetError: The call would be one too many, or comes too late.
        """
        state, limits = self._look(), self._limits
        if turn.role == "agent" and turn.call is not None:
            if len(self.calls) >= limits.n_calls:
                said = f"More than {limits.n_calls} calls."
                raise OutOfBudgetError(said, hint="Decide with fewer calls.")
            if state.time_s > limits.robot_time_s:
                said = f"More than {limits.robot_time_s:.0f} s of robot time."
                raise OutOfBudgetError(said, hint="Drive less.")
            self.calls.append(turn.call)
        self.n_errors += turn.is_error
        if pictures and turn.call is not None and turn.call.tool in PICTURING:
            self.pictured_at = state.pose.point
        noted = replace(
            turn,
            pictures=tuple(starmap(self._keep, enumerate(pictures))),
            wall_s=round(time.perf_counter() - self._begun_s, 3),
            robot_s=state.time_s,
            pose=state.pose,
        )
        self.n_turns += 1
        self._turns.write(turn_line(noted))
        self._turns.flush()
        if self._on_turn is not None:
            self._on_turn(noted)

    def close(self) -> None:
        """End the file."""
        self._turns.close()

    def _keep(self, number: int, picture: Picture) -> str:
        self._pictures.mkdir(exist_ok=True)
        more = f"-{number}" if number else ""
        name = f"{self.n_turns:03d}{more}{picture.suffix}"
        (self._pictures / name).write_bytes(picture.data)
        return name


def attempt(
    run: Path,
    trial: Trial,
    world: World,
    preparation: Trial | None,
    *,
    connection: ServerAccess | None = None,
    control: Path | None = None,
    view: str | None = None,
    on_turn: Callable[[Turn], None] | None = None,
) -> TrialResult:
    """Carry out a trial, write all its records, the result last, and return the result.

    Args:
        preparation: The trial whose map and memory this one starts from; None without one.
        connection: Of the agent to the server; None for the kind that the agent prefers.
        control: Where the robot is held and released; None for a folder of the trial.
        view: Address of a live page, if the server runs as a program; None for no page.
        on_turn: Called with each piece of the conversation, with a call before it is made.
    """
    begun_cpu_s = time.process_time()
    # Trials share the machine: one thread each costs least.
    cv2.setNumThreads(1)
    site, task = GroundTruth(world), find_task(trial.task)
    setup = replace(_prepare(run, trial, site, preparation, control), view=view)
    setting = setup.setting
    as_set = _as_set(site, setting)
    agent = find_agent(trial.agent, trial.thinking, (setting, as_set))
    begun_s = time.perf_counter()
    end, transcript = anyio.run(_work, setup, agent, connection or agent.connection, on_turn)
    wall_s = round(time.perf_counter() - begun_s, 3)
    evidence = _gather(setup.folder, transcript, end)
    result = _sum_up(trial, setting, evidence, end, task.score(as_set, setting, evidence))
    result = replace(
        result,
        n_turns=transcript.n_turns,
        wall_s=wall_s,
        cpu_s=round(time.process_time() - begun_cpu_s, 3),
    )
    write_result(run, result)
    return result


def _prepare(
    run: Path, trial: Trial, site: GroundTruth, preparation: Trial | None, control: Path | None
) -> TrialSetup:
    folder = trial_folder(run, trial)
    folder.mkdir(parents=True, exist_ok=True)
    prepared = None if preparation is None else trial_folder(run, preparation)
    memory = None if prepared is None else _read_if_there(prepared / MEMORY)
    setting = find_task(trial.task).make_setting(site, seed=trial.seed, memory=memory)
    if setting.is_known and prepared is None:
        raise ConfigError(
            f"The task {trial.task} starts from a finished map.", hint="Explore the world first."
        )
    return TrialSetup(
        trial=trial,
        setting=setting,
        world=site.world,
        known_map=prepared / MAP if prepared is not None and setting.is_known else None,
        folder=folder,
        control=control or folder / CONTROL,
    )


def _as_set(site: GroundTruth, setting: Setting) -> GroundTruth:
    """Return the world as the trial has set it; its map frame starts where the robot's does."""
    if not setting.is_known and setting.start != site.world.start:
        site = GroundTruth(replace(site.world, start=setting.start))
    return site.with_more(setting.added)


async def _work(
    setup: TrialSetup,
    agent: Agent,
    connection: ServerAccess,
    on_turn: Callable[[Turn], None] | None,
) -> tuple[AgentEnd, Transcript]:
    setting = setup.setting
    async with open_workplace(setup, connection) as place:
        transcript = Transcript(setup.folder, setting.limits, place.look, on_turn)
        told = "" if place.client is None else place.client.instructions or ""
        system = "\n\n".join(filter(None, (told, setting.guidance)))
        assignment = Assignment(
            prompt=setting.prompt,
            system=system,
            limits=setting.limits,
            seed=setup.trial.seed,
            server=place.command,
            folder=setup.folder,
        )
        end = AgentEnd(answer="It took too long.", state=TrialState.OUT_OF_BUDGET)
        with closing(transcript):
            transcript.hear(Turn(role="system", text=system))
            transcript.hear(Turn(role="user", text=setting.prompt))
            try:
                with anyio.move_on_after(setting.limits.wall_s):
                    end = await agent.work(assignment, ToolClient(place.client, transcript))
            except* OutOfBudgetError as group:
                end = AgentEnd(answer=str(group.exceptions[0]), state=TrialState.OUT_OF_BUDGET)
            transcript.hear(Turn(role="agent", text=end.answer))
    return end, transcript


def _gather(folder: Path, transcript: Transcript, end: AgentEnd) -> Evidence:
    return Evidence(
        states=read_state_log(folder / STATES) if (folder / STATES).exists() else (),
        grid=load_map(folder / MAP).grid if (folder / MAP).exists() else None,
        memory=_read_if_there(folder / MEMORY),
        answer=end.answer,
        state=end.state,
        calls=tuple(transcript.calls),
        pictured_at=transcript.pictured_at,
        n_errors=transcript.n_errors,
    )


def _sum_up(
    trial: Trial, setting: Setting, evidence: Evidence, end: AgentEnd, score: Score
) -> TrialResult:
    n_calls, last = len(evidence.calls), evidence.last
    return TrialResult(
        trial=trial,
        prompt=setting.prompt,
        answer=end.answer,
        state=end.state,
        score=score,
        driven_m=round(last.driven_m, 3),
        shortest_m=setting.truth.get("shortest_m"),
        n_calls=n_calls,
        n_decisions=n_calls if end.n_decisions is None else end.n_decisions,
        n_errors=evidence.n_errors,
        n_input_tokens=end.n_input_tokens,
        n_output_tokens=end.n_output_tokens,
        n_picture_tokens=end.n_picture_tokens,
        robot_s=last.time_s,
        n_collisions=last.n_collisions,
    )


def _read_if_there(path: Path) -> str | None:
    return path.read_text(encoding="utf-8") if path.exists() else None
