"""skills.yaml, in which the owner declares a robot's skills; saved missions are such files too."""

import io
from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from enum import StrEnum
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator
from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

from mapspeak.atomic import replace_file
from mapspeak.errors import ConfigError, SkillError, say_cause
from mapspeak.settings import read_settings
from mapspeak.skill import (
    Arguments,
    OnProgress,
    ParameterKind,
    Skill,
    SkillEffect,
    SkillOutcome,
    SkillParameter,
    SkillSpec,
    SkillState,
    failed,
)
from mapspeak.skills.arguments import check_arguments, check_value
from mapspeak.skills.guarding import OF_FACTS, is_as_wanted
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
                check_value(self.parameter(), self.default, where="default", what=self.name)
            except SkillError as error:
                raise ValueError(str(error)) from error
        return self

    def parameter(self) -> SkillParameter:
        return SkillParameter(
            self.name,
            ParameterKind(self.kind) if self.kind else self._guess(),
            description=self.about,
            unit=self.unit,
            least=self.least,
            most=self.most,
            choices=tuple(self.choices),
            is_required=self.default is None,
            default=self.default,
        )

    def _guess(self) -> ParameterKind:
        """Return the kind that its bounds, its default or its choices show."""
        shown = self.default if self.default is not None else next(iter(self.choices), None)
        match shown:
            case bool():
                return ParameterKind.FLAG
            case str():
                return ParameterKind.TEXT
            case list():
                return ParameterKind.LIST
        is_number = shown is not None or (self.least, self.most, self.unit) != (None, None, "")
        return ParameterKind.NUMBER if is_number else ParameterKind.TEXT


class _Success(_Written):
    field: _Target
    by: _Name | None = None
    equals: _Plain | None = Field(default=None, alias="is")
    above: float | None = None
    below: float | None = None

    @model_validator(mode="after")
    def _says_something(self) -> Self:
        if (self.equals, self.above, self.below) == (None, None, None):
            message = "it needs one of: is, above, below"
            raise ValueError(message)
        return self

    def holds_in(self, result: Arguments) -> bool:
        wanted = {"is": self.equals, "above": self.above, "below": self.below}
        return self.field in result and is_as_wanted(result[self.field], wanted)


class OwnersEntry(_Written):
    """One skill as its owner wrote it.

    Attributes:
        type: Given by the owner, where the robot does not tell it.
        definition: Of the type, likewise; as `ros2 interface show` prints it.
        fixed: Arguments of what it calls that are always the same.
        succeeded_when: Conditions on the result; None where the robot's own report decides.
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
    succeeded_when: _Success | None = None
    timeout_s: Annotated[float, Field(gt=0, le=86_400)] = USUAL_TIMEOUT_S
    within_min: Annotated[float, Field(gt=0, le=MOST_MISSION_MIN)] = USUAL_MISSION_MIN
    needs: dict[str, Any] = {}
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
        try:
            check_arguments(OF_FACTS, self.needs, skill="needs")
        except SkillError as error:
            raise ValueError(str(error)) from error
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
        effect = self.effect or _EFFECTS.get(self.calls, SkillEffect.CHANGES)
        return SkillSpec(
            self.name,
            self.sentence,
            SkillEffect(effect),
            timeout_s=self.within_min * 60 if self.mission is not None else self.timeout_s,
            parameters=tuple(each.parameter() for each in self.arguments),
            needs=self.needs,
            is_always_asked=self.approval == "always",
        )

    @cached_property
    def tree(self) -> Step:
        """The steps of a mission.

        Raises:
            SkillError: They have a mistake.
        """
        return read_tree(self.mission)

    async def run(
        self,
        open_called: Callable[[], Awaitable[Skill]],
        find_skill: Callable[[str], Skill],
        arguments: Arguments,
        on_progress: OnProgress,
    ) -> SkillOutcome:
        """Call what it names, and say that it has failed where the owner's condition does not hold.

        Raises:
            MapspeakError: The robot does not offer it, or an argument does not fit there.
        """
        called, sets = await open_called(), self.sets
        named = {sets[name]: value for name, value in arguments.items()}
        outcome = await called.run({**self.fixed, **named}, on_progress)
        success = self.succeeded_when
        if success is None or outcome.state is not SkillState.SUCCEEDED:
            return outcome
        result = outcome.outputs
        if success.by:
            result = (await find_skill(success.by).run({}, lambda _: None)).outputs
        return outcome if success.holds_in(result) else replace(failed(), outputs=outcome.outputs)


class _SkillsFile(_Written):
    skills: Annotated[list[OwnersEntry], Field(max_length=200)] = []


def load_skills(path: Path) -> tuple[OwnersEntry, ...]:
    """Read skills.yaml, or a file that ships, by its name: nav2, move_base.

    Raises:
        ConfigError: It cannot be read, or has a mistake; says the line and the reason.
    """
    if str(path) in READY_MADE and not path.exists():
        path = Path(__file__).with_name("data") / f"{path}.yaml"
    entries = read_settings(path, _SkillsFile, name="skills.yaml", advice=ADVICE).skills
    names: set[str] = set()
    for each in entries:
        if each.name in names:
            raise ConfigError(
                f"{path}: two skills are called {each.name}.", hint="Rename one of them."
            )
        names.add(each.name)
        try:
            _ = each.mission is None or each.tree
        except SkillError as error:
            said = f"{path}, skill {each.name}: {error.message}"
            raise ConfigError(said, hint=error.hint) from error
    return tuple(entries)


def add_correction(path: Path, name: str, correction: str) -> None:
    """Keep a person's remark about a skill in its file, and leave the rest as it is written there.

    Raises:
        ConfigError: The file cannot be read or written.
    """
    with _changing(path):
        tree = YAML(typ="rt").load(path.read_text(encoding="utf-8"))
    for each in tree["skills"]:
        if each["name"] == name:
            each.setdefault("remember", []).append(correction)
    write_skills(path, tree)


def write_skills(path: Path, tree: Any) -> None:  # noqa: ANN401 - YAML
    """Write a file of skills, as its owner would have.

    Raises:
        ConfigError: It could not be written.
    """
    text = io.StringIO()
    YAML(typ="rt").dump(tree, text)
    with _changing(path):
        replace_file(path, text.getvalue().encode())


def set_aside(path: Path) -> Path:
    """Rename a saved mission's file, so that it is read no more; return what it is called now.

    Raises:
        ConfigError: The file cannot be renamed.
    """
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
