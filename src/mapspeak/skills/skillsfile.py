"""skills.yaml, in which the owner declares a robot's skills; saved missions are such files too."""

import io
from collections.abc import Awaitable, Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from enum import StrEnum
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator
from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

from mapspeak.atomic import replace_file
from mapspeak.errors import ConfigError, SkillError, say_cause
from mapspeak.settings import read_settings
from mapspeak.skill import (
    Arguments,
    OnProgress,
    Schema,
    Skill,
    SkillCode,
    SkillEffect,
    SkillOutcome,
    SkillSpec,
    SkillState,
    parameter,
)
from mapspeak.skills.arguments import LIMITS, check_arguments, check_value
from mapspeak.skills.guarding import CONDITIONS, OF_FACTS, is_as_wanted
from mapspeak.skills.steps import Step, read_tree

NAME = r"^[a-z][a-z0-9_]{0,39}$"
READY_MADE = ("nav2", "move_base")
ADVICE = "docs/howto/skills.md explains every key."
USUAL_MISSION_MIN = 30.0
MOST_MISSION_MIN = 24 * 60.0
USUAL_TIMEOUT_S = 60.0


class Called(StrEnum):
    """The kinds of things that a skill calls."""

    SERVICE = "service"
    ACTION = "action"
    PUBLISH = "publish"
    READ = "read"
    ROBOT_SKILL = "robot_skill"
    MISSION = "mission"


_Name = Annotated[str, Field(pattern=NAME)]
_Words = Annotated[str, Field(max_length=300)]
_Target = Annotated[str, Field(min_length=1, max_length=200)]
_Plain = str | float | int | bool
_Kind = Literal["number", "whole", "text", "flag", "list"]
_KINDS = {"whole": "integer", "text": "string", "flag": "boolean", "list": "array"}
_SHOWN = {str: "string", bool: "boolean", list: "array", int: "number", float: "number"}
_EFFECTS = {Called.READ: SkillEffect.READS, Called.MISSION: SkillEffect.MOVES}


class _Written(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


class _Argument(_Written):
    name: _Name
    about: _Words = ""
    sets: _Target | None = None
    kind: _Kind | None = None
    unit: Annotated[str, Field(max_length=20)] = ""
    least: float | None = None
    most: float | None = None
    choices: Annotated[list[_Plain], Field(max_length=50)] = []
    default: _Plain | list[Any] | None = None

    @model_validator(mode="after")
    def _fits(self) -> Self:
        """Refuse a default that the argument would not take."""
        if self.least is not None and self.most is not None and self.least > self.most:
            message = f"{self.name!r} has least above most"
            raise ValueError(message)
        if self.default is not None:
            try:
                check_value(self.takes, self.default, where="default", what=self.name)
            except SkillError as error:
                raise ValueError(str(error)) from error
        return self

    @property
    def takes(self) -> Schema:
        """What its value may be; of a list and a text `least` and `most` are counts."""
        # Where no kind is said, its default, its choices or its bounds show it.
        shown = self.default if self.default is not None else next(iter(self.choices), None)
        is_number = (self.least, self.most, self.unit) != (None, None, "")
        guess = _SHOWN.get(type(shown), "number" if is_number else "string")
        kind = _KINDS.get(self.kind, self.kind) if self.kind else guess
        is_count, bounds = kind in ("string", "array"), (self.least, self.most)
        limits = (int(each) if is_count and each is not None else each for each in bounds)
        return parameter(
            kind,
            description=self.about,
            unit=self.unit,
            **dict(zip(LIMITS.get(kind, ()), limits, strict=False)),
            enum=self.choices or None,
            default=self.default,
            required=self.default is None,
        )


def _checked(parameters: Mapping[str, Schema]) -> AfterValidator:
    def check(given: dict[str, Any]) -> dict[str, Any]:
        try:
            checked = check_arguments(parameters, given, skill="it")
        except SkillError as error:
            raise ValueError(str(error)) from error
        return {name: checked[name] for name in given}

    return AfterValidator(check)


_JUDGED = {key: CONDITIONS[key] for key in ("is", "above", "below")}
_SUCCESS = {"field": parameter("string", required=True), "by": parameter("string"), **_JUDGED}


class OwnersEntry(_Written):
    """One skill as its owner wrote it.

    Attributes:
        type: Given by the owner, where the robot does not tell it.
        definition: Of the type, likewise; as `ros2 interface show` prints it.
        fixed: Arguments of what it calls that are always the same.
        succeeded_when: Conditions on the result; empty where the robot's own report decides.
        remember: Remarks of people about it since.
    """

    name: _Name
    sentence: _Words = ""
    service: _Target | None = None
    action: _Target | None = None
    publish: _Target | None = None
    read: _Target | None = None
    robot_skill: _Target | None = None
    mission: Any = None
    type: _Target | None = None
    definition: Annotated[str, Field(max_length=20_000)] | None = None
    fixed: dict[str, Any] = {}
    arguments: Annotated[list[_Argument], Field(max_length=40)] = []
    succeeded_when: Annotated[dict[str, Any], _checked(_SUCCESS)] = {}
    timeout_s: Annotated[float, Field(gt=0, le=86_400)] = USUAL_TIMEOUT_S
    within_min: Annotated[float, Field(gt=0, le=MOST_MISSION_MIN)] = USUAL_MISSION_MIN
    needs: Annotated[dict[str, Any], _checked(OF_FACTS)] = {}
    effect: Literal["reads", "moves", "changes"] | None = None
    approval: Literal["as_policy", "always"] = "as_policy"
    remember: list[_Words] = []

    @model_validator(mode="after")
    def _calls_one_thing(self) -> Self:
        if sum(getattr(self, each) is not None for each in Called) != 1:
            message = f"{self.name!r} needs one of: {', '.join(Called)}"
            raise ValueError(message)
        names = [each.name for each in self.arguments]
        if len(set(names)) != len(names):
            message = f"{self.name!r} has two arguments of one name"
            raise ValueError(message)
        if self.succeeded_when and not _JUDGED.keys() & self.succeeded_when.keys():
            message = f"succeeded_when needs one of: {', '.join(_JUDGED)}"
            raise ValueError(message)
        return self

    @property
    def calls(self) -> Called:
        """The kind of thing it calls."""
        return next(each for each in Called if getattr(self, each) is not None)

    @property
    def target(self) -> str:
        """The name of what it calls at the robot; empty for a mission."""
        return "" if self.calls is Called.MISSION else str(getattr(self, self.calls))

    @property
    def sets(self) -> dict[str, str]:
        """The called interface's argument for each of its own."""
        return {each.name: each.sets or each.name for each in self.arguments}

    @cached_property
    def spec(self) -> SkillSpec:
        """Its description as a skill."""
        return SkillSpec(
            self.name,
            self.sentence,
            SkillEffect(self.effect or _EFFECTS.get(self.calls, SkillEffect.CHANGES)),
            timeout_s=self.within_min * 60 if self.mission is not None else self.timeout_s,
            parameters={each.name: each.takes for each in self.arguments},
            needs=self.needs,
            is_always_asked=self.approval == "always",
        )

    @cached_property
    def tree(self) -> Step:
        """The steps of a mission; SkillError where they have a mistake."""
        return read_tree(self.mission)

    async def run(
        self,
        open_called: Callable[[], Awaitable[Skill]],
        find_skill: Callable[[str], Skill],
        arguments: Arguments,
        on_progress: OnProgress,
    ) -> SkillOutcome:
        """Call what it names; where the owner's condition does not hold then, it has failed."""
        called, sets = await open_called(), self.sets
        named = {sets[name]: value for name, value in arguments.items()}
        outcome = await called.run({**self.fixed, **named}, on_progress)
        wanted, result = self.succeeded_when, outcome.outputs
        if not wanted or outcome.state is not SkillState.SUCCEEDED:
            return outcome
        if judge := wanted.get("by"):
            result = (await find_skill(judge).run({}, lambda _: None)).outputs
        has_succeeded = wanted["field"] in result and is_as_wanted(result[wanted["field"]], wanted)
        return outcome if has_succeeded else replace(outcome, code=SkillCode.NOT_ACHIEVED)


class _SkillsFile(_Written):
    skills: Annotated[list[OwnersEntry], Field(max_length=200)] = []


def load_skills(path: Path) -> tuple[OwnersEntry, ...]:
    """Read skills.yaml, or a file that ships, by its name: nav2, move_base.

    ConfigError says the line and the reason of a mistake.
    """
    if str(path) in READY_MADE and not path.exists():
        path = Path(__file__).with_name("data") / f"{path}.yaml"
    entries = read_settings(path, _SkillsFile, name="skills.yaml", advice=ADVICE).skills
    names = [each.name for each in entries]
    for each in entries:
        if names.count(each.name) > 1:
            said = f"{path}: two skills are called {each.name}."
            raise ConfigError(said, hint="Rename one of them.")
        try:
            _ = each.mission is None or each.tree
        except SkillError as error:
            said = f"{path}, skill {each.name}: {error.message}"
            raise ConfigError(said, hint=error.hint) from error
    return tuple(entries)


def add_correction(path: Path, name: str, correction: str) -> None:
    """Keep a person's remark about a skill in its file, and leave the rest as it is written there.

    ConfigError where the file cannot be read or written.
    """
    with _changing(path):
        tree = YAML(typ="rt").load(path.read_text(encoding="utf-8"))
    for each in tree["skills"]:
        if each["name"] == name:
            each.setdefault("remember", []).append(correction)
    write_skills(path, tree)


def write_skills(path: Path, tree: Any) -> None:  # noqa: ANN401 - YAML
    """Write a file of skills as its owner would have; ConfigError where that cannot be."""
    text = io.StringIO()
    YAML(typ="rt").dump(tree, text)
    with _changing(path):
        replace_file(path, text.getvalue().encode())


def set_aside(path: Path) -> Path:
    """Rename a saved mission's file, so that it is read no more, or raise ConfigError."""
    with _changing(path):
        return path.replace(path.with_name(f"{path.name}.forgotten"))


@contextmanager
def _changing(path: Path) -> Iterator[None]:
    try:
        yield
    except (OSError, YAMLError) as error:
        raise ConfigError(
            f"{path} could not be written: {say_cause(error)}.", hint="Check disk and permissions."
        ) from error
