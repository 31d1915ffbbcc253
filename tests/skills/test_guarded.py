"""A skill is checked, allowed by the guard, noted, and ended in time."""

from dataclasses import dataclass
from pathlib import Path

import anyio
import pytest

from guarding import audit_of, make_guard
from mapspeak.errors import PolicyError, SkillError
from mapspeak.safety import (
    Approval,
    ApprovalNeededError,
    Call,
    CommandKind,
    Guard,
    Otherwise,
    Patterns,
    Policy,
)
from mapspeak.skill import Arguments, JsonValue, SkillCode, SkillOutcome, SkillState, parameter
from mapspeak.skills.arguments import check_arguments
from mapspeak.skills.guarding import SkillGate
from skillmaking import FakeFacts, FakeSkill, never, spec, tell_nobody

pytestmark = pytest.mark.anyio

QUEUE = Approval(otherwise=Otherwise.QUEUE)


def approve_all(guard: Guard) -> None:
    """Says yes to all that waits for a person's word."""
    for request_id in guard.approvals.room.list_waiting():
        guard.approvals.room.approve(request_id)


async def test_a_skill_is_noted_before_it_runs_and_when_it_has_ended(tmp_path: Path) -> None:
    skill = FakeSkill(spec())
    guarded = SkillGate(FakeFacts(), make_guard(tmp_path)).hold(skill)
    outcome = await guarded.run({}, tell_nobody)
    assert outcome.state is SkillState.SUCCEEDED
    told = [(line.event, line.kind, line.said) for line in audit_of(tmp_path)]
    assert told == [("decision", "skill", ""), ("result", "skill", "succeeded")]


async def test_a_skill_that_the_policy_denies_is_not_run(tmp_path: Path) -> None:
    skill = FakeSkill(spec("lift_pallet"))
    policy = Policy(patterns={CommandKind.SKILL: Patterns(deny=("lift*",))})
    guarded = SkillGate(FakeFacts(), make_guard(tmp_path, policy)).hold(skill)
    with pytest.raises(PolicyError, match="lift"):
        await guarded.run({}, tell_nobody)
    assert skill.given == []


async def test_a_held_robot_runs_no_skill(tmp_path: Path) -> None:
    guard, skill = make_guard(tmp_path), FakeSkill(spec())
    guard.hold.put("a person", at=guard.wall_clock())
    with pytest.raises(PolicyError, match="held"):
        await SkillGate(FakeFacts(), guard).hold(skill).run({}, tell_nobody)
    assert skill.given == []


async def test_a_persons_word_for_a_skill_covers_what_it_commands_and_no_more(
    tmp_path: Path,
) -> None:
    guard = make_guard(tmp_path, Policy(approval=QUEUE))
    denied_usually = Call(
        service="/set_initial_pose", type="nav2_msgs/SetInitialPose", arguments={}
    )

    async def do(_arguments: object) -> SkillOutcome:
        guard.clear(denied_usually, robot_s=0.0)
        return SkillOutcome()

    skill = FakeSkill(spec("set_pose", is_always_asked=True), do=do)
    guarded = SkillGate(FakeFacts(), guard).hold(skill, is_through_guard=True)
    with pytest.raises(ApprovalNeededError, match="set_pose"):
        await guarded.run({}, tell_nobody)
    approve_all(guard)
    assert (await guarded.run({}, tell_nobody)).state is SkillState.SUCCEEDED
    with pytest.raises(PolicyError, match="usual_denials"):
        guard.clear(denied_usually, robot_s=0.0)
    with pytest.raises(ApprovalNeededError):
        await guarded.run({}, tell_nobody)


async def test_a_word_for_a_skill_opens_nothing_that_a_person_has_denied(tmp_path: Path) -> None:
    patterns = {CommandKind.CALL: Patterns(deny=("/set_initial_pose",))}
    guard = make_guard(tmp_path, Policy(approval=QUEUE, patterns=patterns))

    async def do(_arguments: object) -> SkillOutcome:
        guard.clear(Call(service="/set_initial_pose", type="", arguments={}), robot_s=0.0)
        return SkillOutcome()

    skill = FakeSkill(spec("set_pose", is_always_asked=True), do=do)
    guarded = SkillGate(FakeFacts(), guard).hold(skill, is_through_guard=True)
    with pytest.raises(ApprovalNeededError):
        await guarded.run({}, tell_nobody)
    approve_all(guard)
    with pytest.raises(PolicyError, match=r"call\.deny"):
        await guarded.run({}, tell_nobody)


@pytest.mark.parametrize(
    "needs",
    [
        {"battery_above": 0.3},
        {"standing": True},
        {"in_room": "R2"},
        {"not": True, "battery_below": 0.3},
        {"time_from": "11:30", "sees": "cat"},
    ],
)
async def test_what_does_not_hold_keeps_a_skill_from_being_begun(needs: Arguments) -> None:
    facts = FakeFacts(battery=0.2, stands=False, rooms={"R1"})
    skill = FakeSkill(spec(needs=needs))
    guarded = SkillGate(facts, None).hold(skill)
    outcome = await guarded.run({}, tell_nobody)
    assert (outcome.code, bool(outcome.unmet)) == (SkillCode.PRECONDITION, True)
    assert skill.given == []
    facts.battery, facts.stands, facts.rooms, facts.seen = 0.4, True, {"R2"}, {"cat"}
    assert (await guarded.run({}, tell_nobody)).state is SkillState.SUCCEEDED


async def test_a_battery_that_nothing_tells_of_is_not_above_anything() -> None:
    needs = {"battery_above": 0.0}
    guarded = SkillGate(FakeFacts(), None).hold(FakeSkill(spec(needs=needs)))
    assert (await guarded.run({}, tell_nobody)).code is SkillCode.PRECONDITION


async def test_a_skill_that_never_ends_is_ended_by_the_robots_clock() -> None:
    skill = FakeSkill(spec(timeout_s=5.0), do=never)
    guarded = SkillGate(FakeFacts(passes_s=3.0), None).hold(skill)
    outcome = await guarded.run({}, tell_nobody)
    assert (outcome.state, outcome.numbers) == (SkillState.TIMED_OUT, {"after_s": 5.0})
    assert skill.n_ended == 1


async def test_arguments_that_do_not_fit_are_refused_before_anything_else(tmp_path: Path) -> None:
    width = parameter("number", maximum=0.1, required=True)
    skill = FakeSkill(spec(parameters={"width": width}))
    guarded = SkillGate(FakeFacts(), make_guard(tmp_path)).hold(skill)
    for wrong in (2, 10**400, float("nan"), "wide"):
        with pytest.raises(SkillError, match="width"):
            await guarded.run({"width": wrong}, tell_nobody)
    assert (skill.given, list(audit_of(tmp_path))) == ([], [])


@dataclass
class BegunAnew(FakeFacts):
    """Facts of a simulation that is begun anew after a while."""

    n_looks: int = 0

    @property
    def now_s(self) -> float:
        self.n_looks += 1
        return 1_000.0 + self.n_looks if self.n_looks < 4 else float(self.n_looks)


async def test_a_clock_that_is_set_back_prolongs_no_skill() -> None:
    guarded = SkillGate(BegunAnew(), None).hold(FakeSkill(spec(timeout_s=8.0), do=never))
    with anyio.fail_after(20.0):
        outcome = await guarded.run({}, tell_nobody)
    assert outcome.state is SkillState.TIMED_OUT


@pytest.mark.parametrize(
    ("kind", "given", "taken"),
    [
        ("integer", 3.0, 3),
        ("integer", "3", 3),
        ("number", "9007199254740993", 2**53 + 1),
        ("number", 0.5, 0.5),
        ("string", 3.0, "3"),
        ("boolean", "true", True),
        ("array", (1, 2), [1, 2]),
    ],
)
def test_an_argument_is_taken_as_its_schema_wants_it(
    kind: str, given: JsonValue, taken: JsonValue
) -> None:
    checked = check_arguments({"value": parameter(kind)}, {"value": given}, skill="it")["value"]
    assert (checked, type(checked)) == (taken, type(taken))


@pytest.mark.parametrize(
    ("kind", "given"),
    [
        ("boolean", "yes"),
        ("boolean", 1),
        ("number", True),
        ("number", 10**400),
        ("number", "nan"),
        ("integer", "3.5"),
        ("array", "12"),
        ("object", [1]),
    ],
)
def test_what_is_no_value_of_a_schema_is_refused(kind: str, given: JsonValue) -> None:
    with pytest.raises(SkillError, match="value cannot be"):
        check_arguments({"value": parameter(kind)}, {"value": given}, skill="it")
