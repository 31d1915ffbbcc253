"""The tools of missions: run, answer, save, show, forget."""

from collections.abc import Mapping
from typing import Annotated, Any

from mcp.server.mcpserver import Context, Image
from pydantic import Field, WithJsonSchema

from mapspeak.errors import SkillError
from mapspeak.memory.quoting import quote
from mapspeak.server.text.missions import (
    say_bounds,
    say_interrupted,
    say_plan,
    say_question,
    say_skills,
)
from mapspeak.server.tools.asking import AT_MOST_LONGEST_WAIT, LONGEST_WAIT_S
from mapspeak.server.tools.skills.book import SkillBook
from mapspeak.server.tools.skills.reports import say_run
from mapspeak.server.tools.skills.running import tell_news
from mapspeak.server.tools.toolset import ToolEffect, tool
from mapspeak.skill import ParameterKind, SkillEffect, SkillParameter, SkillSpec
from mapspeak.skills.missions.reading import parse_tree, read_tree
from mapspeak.skills.missions.tree import MissionPlan
from mapspeak.skills.owners.skillsfile import (
    MOST_MISSION_MIN,
    NAME,
    USUAL_MISSION_MIN,
    add_correction,
    write_mission,
)
from mapspeak.skills.runs import SkillRuns

MOST_ARGUMENTS = 20
Tree = Annotated[
    Any,
    WithJsonSchema({"type": "string", "description": "YAML or JSON"}),
]
"""A text for its writers; the server has read one that is JSON by the time it comes here."""
Name = Annotated[str, Field(description="small letters, digits, _", pattern=NAME)]
SavedName = Annotated[str | None, Field(description="of a saved mission", max_length=60)]
Values = Annotated[
    list[str] | None,
    Field(description="of a saved mission: name=value each", max_length=MOST_ARGUMENTS),
]
Parameters = Annotated[
    list[str] | None,
    Field(
        description="names that steps use as {name}; name=default where it may be left out",
        max_length=MOST_ARGUMENTS,
    ),
]
Minutes = Annotated[float, Field(description="it ends after so long", gt=0, le=MOST_MISSION_MIN)]
Wait = Annotated[
    float,
    Field(description="seconds to wait for its end or a question", ge=0, le=LONGEST_WAIT_S),
    AT_MOST_LONGEST_WAIT,
]
Sentence = Annotated[str, Field(description="what it does", max_length=300)]
Correction = Annotated[
    str | None,
    Field(description="what a person wants of it, such as: knock first", max_length=300),
]
QuestionId = Annotated[str | None, Field(description="such as Q1; else the oldest", max_length=20)]
Answer = Annotated[str | None, Field(description="left out, it shows the question", max_length=300)]


class MissionTools:
    """Missions: trees of skills that the server runs by itself."""

    def __init__(self, book: SkillBook, runs: SkillRuns) -> None:
        self._book = book
        self._runs = runs

    @tool(
        "Run a mission",
        ToolEffect.MOVES,
        leads="{skill_status} waits on. {cancel_skill} or {stop_robot} ends it. "
        "{answer_mission} answers its questions. {show_missions} names skills.",
    )
    async def run_mission(
        self,
        context: Context,
        tree: Tree = None,
        name: SavedName = None,
        values: Values = None,
        within_min: Minutes = USUAL_MISSION_MIN,
        wait_s: Wait = 10.0,
    ) -> str:
        """Run a tree of steps that may move the robot, by itself, until it ends.

        tree is YAML: a list of steps, each `skill: argument`: drive: R3; look: D2; note: text;
        wait: 5; ask: question (answers: [a, b], otherwise: b, within_s); check or wait_for:
        {battery_above: 0.3, in_room, near, event, sees, time_from, value: "{x}", is, above, not}.
        `as: x` keeps a result for "{x.field}". Around steps: sequence, fallback, parallel: [...];
        retry: 3, repeat: 3, timeout_s: 60, every_min: 60 (times), until: {...} (times), each
        with do: [...].
        """
        if (tree is None) == (name is None):
            raise SkillError("A mission is either a tree or a name.", hint="Give one of them.")
        if tree is not None:
            plan = MissionPlan(
                spec=_spec("mission", within_min * 60, ()), tree=read_tree(parse_tree(tree))
            )
            given: Mapping[str, Any] = {}
        else:
            self._book.load_saved()
            plan = self._find_saved(str(name))
            given = read_values(plan.spec, values or [])
        bounds = self._book.desk.check(plan)
        run = await self._runs.begin(
            self._book.plan(plan), given, client="", wait_s=wait_s, on_news=tell_news(context)
        )
        remember = [
            f"Remember, as a person said: {quote(each, most=300)}." for each in plan.remember
        ]
        told = [*remember, say_bounds(bounds, plan.spec.timeout_s)]
        return "\n".join([*told, say_run(run, self._book.questions)])

    @tool("Answer a mission", ToolEffect.REMEMBERS)
    async def answer_mission(
        self, question: QuestionId = None, answer: Answer = None
    ) -> list[str | Image]:
        """Show the question that a mission asks, with its picture, or answer it.

        Look at the picture before you answer; where you cannot tell, leave it to the fallback.
        """
        found = self._book.questions.find(question)
        if answer is not None:
            taken = self._book.questions.answer(found, answer)
            return [f"{found.id} is answered: {taken}."]
        shown: list[str | Image] = [say_question(found)]
        if found.picture is not None:
            shown.append(Image(data=found.picture.data, format=found.picture.format))
        return shown

    @tool("Save a mission", ToolEffect.REMEMBERS)
    async def save_mission(
        self,
        name: Name,
        tree: Tree = None,
        sentence: Sentence = "",
        parameters: Parameters = None,
        within_min: Minutes = USUAL_MISSION_MIN,
        correction: Correction = None,
    ) -> str:
        """Keep a mission under a name: it is a skill from then on, in other missions too.

        Or keep a person's correction with a saved one: give name and correction.
        """
        self._book.load_saved()
        if tree is None:
            return self._correct(name, correction)
        self._book.check_free(name)
        written = parse_tree(tree)
        wanted = [_read_parameter(each) for each in parameters or []]
        plan = MissionPlan(
            spec=_spec(name, within_min * 60, tuple(wanted)), tree=read_tree(written)
        )
        bounds = self._book.desk.check(plan)
        entry: dict[str, Any] = {"name": name, "sentence": sentence}
        if wanted:
            entry["arguments"] = [_write_parameter(each) for each in wanted]
        entry |= {"within_min": within_min, "mission": written}
        kept = self._book.saved.get(name)
        remember = [*(kept.plan.remember if kept else ()), *([correction] if correction else [])]
        if remember:
            entry["remember"] = remember
        path = self._book.folder / f"{name}.yaml"
        write_mission(path, entry)
        self._book.load_saved()
        return f"Saved {name} in {path}.\n{say_plan(self._find_saved(name), bounds)}"

    @tool("Show missions and skills", ToolEffect.READS)
    async def show_missions(self, name: SavedName = None) -> str:
        """List skills and saved missions, or show one mission as a tree with what it may do."""
        self._book.load_saved()
        if name is not None:
            plan = self._find_saved(name)
            return say_plan(plan, self._book.desk.check(plan))
        told = [say_interrupted(self._book.interrupted), say_skills(self._book.skills.values())]
        return "\n".join(filter(None, told))

    @tool("Forget a mission", ToolEffect.REMEMBERS)
    async def forget_mission(self, name: Name) -> str:
        """Forget a saved mission; its file is kept beside as NAME.yaml.forgotten."""
        self._book.load_saved()
        self._find_saved(name)
        path = self._book.saved[name].path
        path.replace(path.with_name(f"{path.name}.forgotten"))
        self._book.load_saved()
        return f"{name} is forgotten; its file is {path.name}.forgotten."

    def _correct(self, name: str, correction: str | None) -> str:
        if not correction:
            raise SkillError("Nothing is to be saved.", hint="Give a tree, or a correction.")
        self._find_saved(name)
        add_correction(self._book.saved[name].path, name, correction)
        self._book.load_saved()
        plan = self._find_saved(name)
        return say_plan(plan, self._book.desk.check(plan))

    def _find_saved(self, name: str) -> MissionPlan:
        if name not in self._book.saved:
            known = ", ".join(self._book.saved) or "none"
            raise SkillError(f"No mission is called {name[:60]!r}.", hint=f"Saved: {known}.")
        return self._book.saved[name].plan


def _spec(name: str, timeout_s: float, parameters: tuple[SkillParameter, ...]) -> SkillSpec:
    return SkillSpec(
        name=name,
        description="",
        effect=SkillEffect.MOVES,
        timeout_s=timeout_s,
        parameters=parameters,
    )


def _read_parameter(said: str) -> SkillParameter:
    """Return a parameter written as name or name=default."""
    name, has_default, default = said.partition("=")
    if not name.strip().isidentifier():
        raise SkillError(f"{said[:60]!r} is no parameter.", hint="Write name, or name=default.")
    return SkillParameter(
        name=name.strip(),
        kind=ParameterKind.TEXT,
        most=200,
        is_required=not has_default,
        default=default.strip() if has_default else None,
    )


def _write_parameter(parameter: SkillParameter) -> dict[str, Any]:
    written: dict[str, Any] = {"name": parameter.name, "kind": "text"}
    return written | ({} if parameter.default is None else {"default": parameter.default})


def read_values(spec: SkillSpec, values: list[str]) -> Mapping[str, Any]:
    """Return arguments written as name=value, as what their parameters hold."""
    kinds = {each.name: each.kind for each in spec.parameters}
    given: dict[str, Any] = {}
    for each in values:
        name, equals, value = each.partition("=")
        if not equals:
            raise SkillError(f"{each[:60]!r} is no value.", hint="Write name=value.")
        plain, kind = value.strip(), kinds.get(name.strip(), ParameterKind.TEXT)
        given[name.strip()] = plain if kind is ParameterKind.TEXT else parse_tree(plain)
    return given
