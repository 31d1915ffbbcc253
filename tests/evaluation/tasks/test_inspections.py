"""The questions about a robot's ROS: how they are drawn, and that they can be answered."""

from pathlib import Path

import anyio
import pytest

from hearing import Hearing
from mapspeak.evaluation.agent import Assignment, ServerAccess, ToolClient
from mapspeak.evaluation.agents.baselines import answer_at_random
from mapspeak.evaluation.agents.catalogue import SCRIPTS
from mapspeak.evaluation.agents.scripted import follow_script
from mapspeak.evaluation.runs.workplace import open_inspection
from mapspeak.evaluation.scores.groundtruth import GroundTruth
from mapspeak.evaluation.scores.judging import Evidence
from mapspeak.evaluation.tasks.catalogue import FAMILIES, find_task
from mapspeak.evaluation.trials import Score, Setting
from mapspeak.ros.messages.fields import Dialect
from sites import make_flat

pytestmark = pytest.mark.anyio
TASKS = FAMILIES["inspection"]
PATIENCE_S = 240.0
N_TRIES = 3
AT_ONCE = 3


@pytest.fixture
def site(tmp_path: Path) -> GroundTruth:
    return GroundTruth(make_flat(tmp_path))


def set_up(site: GroundTruth, task: str, seed: int) -> Setting:
    return find_task(task).make_setting(site, seed=seed, memory=None)


def judge(site: GroundTruth, task: str, setting: Setting, answer: str) -> Score:
    evidence = Evidence(states=(), answer=answer)
    return find_task(task).score(site, setting, evidence)


def assign(setting: Setting, seed: int, folder: Path) -> Assignment:
    return Assignment(
        prompt=setting.prompt,
        system="",
        limits=setting.limits,
        seed=seed,
        server=(),
        folder=folder,
    )


async def ask(site: GroundTruth, task: str, seed: int, folder: Path) -> Score:
    """Lets the scripted policy answer over the wire, and gives what the answer is worth."""
    setting, folder = set_up(site, task, seed), folder / f"{task}-{seed}"
    assert setting.inspected is not None
    folder.mkdir(exist_ok=True)
    async with open_inspection(
        setting.inspected, ServerAccess.MEMORY, toolsets=("ros",), folder=folder
    ) as opened:
        end = await follow_script(assign(setting, seed, folder), ToolClient(opened.client))
    return judge(site, task, setting, end.answer)


def test_there_are_a_dozen_questions_and_more() -> None:
    assert len(TASKS) >= 12


@pytest.mark.parametrize("task", TASKS)
def test_the_truth_is_a_right_answer_and_no_other_seeds_truth_is_always_one(
    site: GroundTruth, task: str
) -> None:
    settings = [set_up(site, task, seed) for seed in range(12)]
    answers = [f"ANSWER: {setting.truth['said']}" for setting in settings]
    for setting, answer in zip(settings, answers, strict=True):
        assert judge(site, task, setting, answer).is_success
    for answer in answers:
        n_right = sum(judge(site, task, each, answer).is_success for each in settings)
        assert n_right <= len(settings) // 3, answer


@pytest.mark.parametrize("task", TASKS)
def test_a_question_says_its_form_and_that_nobody_drives(site: GroundTruth, task: str) -> None:
    setting = set_up(site, task, 0)
    assert "Answer without driving." in setting.prompt
    assert "ANSWER: " in setting.prompt
    assert setting.toolsets == ("ros",)
    assert not setting.is_known


@pytest.mark.parametrize("task", TASKS)
def test_the_form_that_a_question_shows_is_no_right_answer(site: GroundTruth, task: str) -> None:
    setting = set_up(site, task, 0)
    example = setting.prompt.rpartition("ANSWER: ")[2].rstrip(".")
    assert not judge(site, task, setting, f"ANSWER: {example}").is_success


@pytest.mark.parametrize("task", TASKS)
def test_the_same_seed_asks_the_same(site: GroundTruth, task: str) -> None:
    first, again, other = (set_up(site, task, seed) for seed in (5, 5, 7))
    assert (first.prompt, first.truth) == (again.prompt, again.truth)
    assert (first.prompt, first.truth) != (other.prompt, other.truth)


def test_seeds_take_turns_between_the_two_ros(site: GroundTruth) -> None:
    asked = [set_up(site, TASKS[0], seed).inspected for seed in range(4)]
    dialects = [system.dialect for system in asked if system is not None]
    assert dialects == [Dialect.ROS2, Dialect.ROS1, Dialect.ROS2, Dialect.ROS1]


@pytest.mark.parametrize("seed", [20, 21], ids=["ros2", "ros1"])
async def test_the_scripted_policy_finds_every_answer_over_the_wire(
    site: GroundTruth, tmp_path: Path, seed: int
) -> None:
    wrong: list[str] = []

    # More at a time would be more than one event loop can play in time.
    some = anyio.CapacityLimiter(AT_ONCE)

    async def ask_one(task: str) -> None:
        async with some:
            # On a loaded machine the system itself may publish too slowly for once.
            for _ in range(N_TRIES):
                score = await ask(site, task, seed, tmp_path)
                if score.is_success:
                    return
        wrong.append(f"{task}: {score.reason}")

    with anyio.fail_after(PATIENCE_S):
        async with anyio.create_task_group() as tasks:
            for task in TASKS:
                tasks.start_soon(ask_one, task)
    assert wrong == []


@pytest.mark.parametrize("task", TASKS)
async def test_chance_answers_nothing(site: GroundTruth, tmp_path: Path, task: str) -> None:
    for seed in range(5):
        setting = set_up(site, task, seed)
        end = await answer_at_random(assign(setting, seed, tmp_path), ToolClient(None))
        assert not judge(site, task, setting, end.answer).is_success, end.answer


@pytest.mark.parametrize("script", sorted(SCRIPTS))
async def test_no_script_calls_a_tool_that_is_not_offered(
    site: GroundTruth, tmp_path: Path, script: str
) -> None:
    setting = set_up(site, "inspect-missing", 0)
    assert setting.inspected is not None
    async with open_inspection(
        setting.inspected, ServerAccess.MEMORY, toolsets=("ros",), folder=tmp_path
    ) as opened:
        assert opened.client is not None
        offered = {tool.name for tool in (await opened.client.list_tools()).tools}
        heard = Hearing()
        await SCRIPTS[script](assign(setting, 0, tmp_path), ToolClient(opened.client, heard))
    assert {*heard.calls} <= offered


async def test_what_is_offered_only_reads(site: GroundTruth, tmp_path: Path) -> None:
    setting = set_up(site, TASKS[0], 0)
    assert setting.inspected is not None
    async with open_inspection(
        setting.inspected, ServerAccess.MEMORY, toolsets=("ros",), folder=tmp_path
    ) as opened:
        assert opened.client is not None
        names = {tool.name for tool in (await opened.client.list_tools()).tools}
    assert "ros_read" in names
    assert not {"ros_publish", "ros_call", "ros_set_parameter", "ros_send_goal"} & names
