"""One trial from its setting to its score, in this process."""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import anyio
import cv2

from mapspeak.errors import ConfigError
from mapspeak.evaluation.agents import find_agent
from mapspeak.evaluation.client import OutOfBudgetError, ToolClient
from mapspeak.evaluation.runs.transcript import Transcript
from mapspeak.evaluation.runs.workplace import (
    CONTROL,
    MAP,
    MEMORY,
    STATES,
    Workshop,
    open_workplace,
)
from mapspeak.evaluation.scores import Evidence, GroundTruth
from mapspeak.evaluation.tasks import Task, find_task
from mapspeak.evaluation.trials import (
    Agent,
    AgentEnd,
    Assignment,
    ServerAccess,
    Setting,
    Trial,
    TrialResult,
    TrialState,
    Turn,
    trial_folder,
    write_result,
)
from mapspeak.simulator import World, read_state_log
from mapspeak.spatial.mapfiles import load_map

__all__ = ["attempt"]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Course:
    """How a trial went, before anybody judges it."""

    end: AgentEnd
    n_turns: int
    n_errors: int
    evidence: Evidence
    wall_s: float


def attempt(
    run: Path,
    trial: Trial,
    world: World,
    preparation: Trial | None,
    *,
    connection: ServerAccess | None = None,
    control: Path | None = None,
    on_turn: Callable[[Turn], None] | None = None,
) -> TrialResult:
    """Carry out a trial, write everything about it, its result last, and return that.

    Args:
        run: The run's folder.
        trial: Which attempt.
        world: Its world.
        preparation: The trial whose map and memory this one starts from; None where there is none.
        connection: How the agent reaches the server; None for the way that the agent prefers.
        control: Where the robot is held and released; None for a folder of the trial.
        on_turn: Told of each piece of the conversation, a call before it is made.
    """
    begun_s = time.process_time()
    # Trials share the machine: one thread each costs least.
    cv2.setNumThreads(1)
    folder = trial_folder(run, trial)
    folder.mkdir(parents=True, exist_ok=True)
    prepared = None if preparation is None else trial_folder(run, preparation)
    site, task = GroundTruth(world), find_task(trial.task)
    memory = _read_if_there(prepared / MEMORY) if prepared is not None else None
    setting = task.make_setting(site, seed=trial.seed, memory=memory)
    if setting.is_known and prepared is None:
        raise ConfigError(
            f"The task {trial.task} starts from a finished map.", hint="Explore the world first."
        )
    shop = Workshop(
        trial=trial,
        setting=setting,
        world=world,
        known_map=prepared / MAP if prepared is not None and setting.is_known else None,
        folder=folder,
        control=control or folder / CONTROL,
    )
    as_set = _as_set(site, setting)
    agent = find_agent(trial, setting, as_set)
    course = anyio.run(_work, shop, agent, connection or agent.connection, on_turn)
    result = _judge(trial, setting, task, as_set, course)
    result = replace(result, cpu_s=round(time.process_time() - begun_s, 3))
    write_result(run, result)
    return result


def _as_set(site: GroundTruth, setting: Setting) -> GroundTruth:
    """Return the world as the trial has set it; its map frame starts where the robot's does."""
    if not setting.is_known and setting.start != site.world.start:
        site = GroundTruth(replace(site.world, start=setting.start))
    return site.with_more(setting.added)


async def _work(
    shop: Workshop,
    agent: Agent,
    connection: ServerAccess,
    on_turn: Callable[[Turn], None] | None,
) -> _Course:
    begun_s = time.perf_counter()
    setting = shop.setting
    async with open_workplace(shop, connection) as place:
        transcript = Transcript(shop.folder, setting.limits, place.look, on_turn)
        system = "\n\n".join(filter(None, (place.instructions, setting.guidance)))
        assignment = Assignment(
            prompt=setting.prompt,
            system=system,
            limits=setting.limits,
            seed=shop.trial.seed,
            server=place.command,
            folder=shop.folder,
        )
        transcript.hear_words("system", system)
        transcript.hear_words("user", setting.prompt)
        try:
            end = await _run_agent(agent, assignment, ToolClient(place.client, transcript))
            transcript.hear_words("agent", end.answer)
        finally:
            transcript.close()
    return _Course(
        end=end,
        n_turns=transcript.n_turns,
        n_errors=transcript.n_errors,
        evidence=_gather(shop.folder, transcript, end),
        wall_s=time.perf_counter() - begun_s,
    )


async def _run_agent(agent: Agent, assignment: Assignment, tools: ToolClient) -> AgentEnd:
    end = AgentEnd(answer="It took too long.", state=TrialState.OUT_OF_BUDGET)
    try:
        with anyio.move_on_after(assignment.limits.wall_s):
            end = await agent.run(assignment, tools)
    except* OutOfBudgetError as group:
        end = AgentEnd(answer=str(group.exceptions[0]), state=TrialState.OUT_OF_BUDGET)
    return end


def _gather(folder: Path, transcript: Transcript, end: AgentEnd) -> Evidence:
    states = read_state_log(folder / STATES) if (folder / STATES).exists() else ()
    grid = load_map(folder / MAP).grid if (folder / MAP).exists() else None
    return Evidence(
        states=states,
        grid=grid,
        memory=_read_if_there(folder / MEMORY),
        answer=end.answer,
        state=end.state,
        calls=tuple(transcript.calls),
        n_errors=transcript.n_errors,
    )


def _judge(
    trial: Trial, setting: Setting, task: Task, site: GroundTruth, course: _Course
) -> TrialResult:
    evidence, end = course.evidence, course.end
    return TrialResult(
        trial=trial,
        prompt=setting.prompt,
        answer=end.answer,
        state=end.state,
        score=task.score(site, setting, evidence),
        driven_m=round(evidence.last.driven_m, 3),
        shortest_m=setting.truth.get("shortest_m"),
        n_turns=course.n_turns,
        n_calls=len(evidence.calls),
        n_decisions=len(evidence.calls) if end.n_decisions is None else end.n_decisions,
        n_errors=course.n_errors,
        n_input_tokens=end.n_input_tokens,
        n_output_tokens=end.n_output_tokens,
        n_picture_tokens=end.n_picture_tokens,
        robot_s=evidence.last.time_s,
        wall_s=round(course.wall_s, 3),
        n_collisions=evidence.last.n_collisions,
    )


def _read_if_there(path: Path) -> str | None:
    return path.read_text(encoding="utf-8") if path.exists() else None
