"""The tools of skills and missions: call, ask, cancel; run, answer, save, show, forget."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Annotated, Any

from mcp.server.mcpserver import Context, Image
from mcp.server.mcpserver.exceptions import ToolError
from mcp_types import CallToolResult, TextContent
from pydantic import Field, WithJsonSchema

from mapspeak.errors import GoalError, LinkError, MapError, MapspeakError, SkillError
from mapspeak.places.relations.choosing import find_place
from mapspeak.safety import current_caller
from mapspeak.server.text.offered import say_error
from mapspeak.server.text.skills import (
    say_bounds,
    say_interrupted,
    say_mission,
    say_question,
    say_run,
    say_skills,
)
from mapspeak.server.text.wording import say_count
from mapspeak.server.tools.caller import LONGEST_WAIT_S, WaitForEnd, find_reader, shorten_wait
from mapspeak.server.tools.sightings import show_picture
from mapspeak.server.tools.skills.book import WAIT, WAITS, SkillBook, is_long
from mapspeak.server.tools.skills.leaves import AHEAD, BUILT_IN, PLACES
from mapspeak.server.tools.toolset import ToolEffect, tool
from mapspeak.skill import Arguments, JsonValue, Skill
from mapspeak.skills.arguments import check_arguments, check_value
from mapspeak.skills.missions import MissionBounds
from mapspeak.skills.runs import OnNews, SkillRun, SkillRuns
from mapspeak.skills.skillsfile import (
    MOST_MISSION_MIN,
    NAME,
    USUAL_MISSION_MIN,
    OwnersEntry,
    add_correction,
    set_aside,
    write_skills,
)
from mapspeak.skills.steps import Mission, fill_in, find_names, parse_tree
from mapspeak.worldmodel.model import WorldModel

MOST_ARGUMENTS = 20
Tree = Annotated[Any, WithJsonSchema({"type": "string", "description": "YAML or JSON"})]
"""A text for its writers; the server has read one that is JSON by the time it comes here."""
Name = Annotated[str, Field(description="small letters, digits, _", pattern=NAME)]
SavedName = Annotated[str | None, Field(description="of a saved mission", max_length=60)]
Values = Annotated[
    dict[str, Any] | None,
    Field(description="what a saved mission takes, by name", max_length=MOST_ARGUMENTS),
]
Parameters = Annotated[
    dict[str, str | None] | None,
    Field(
        description="names that steps use as {name}, each with its default, or null without one",
        max_length=MOST_ARGUMENTS,
    ),
]
Minutes = Annotated[float, Field(description="it ends after so long", gt=0, le=MOST_MISSION_MIN)]
Sentence = Annotated[str, Field(description="what it does", max_length=300)]
Correction = Annotated[
    str | None, Field(description="what a person wants of it, such as: knock first", max_length=300)
]
QuestionId = Annotated[str | None, Field(description="such as Q1; else the oldest", max_length=20)]
Answer = Annotated[str | None, Field(description="left out, it shows the question", max_length=300)]
Taken = Annotated[str | None, Field(description="such as P2, of a look", max_length=20)]
Handle = Annotated[str | None, Field(description="such as S1; else the latest", max_length=40)]


class SkillRunTools:
    """Asking and cancelling; each skill is a tool of its own."""

    def __init__(self, runs: SkillRuns) -> None:
        self._runs = runs
        self._told: tuple[str, str, Sequence[str]] | None = None
        # The reader of the last answer, the run under way that it told of, and its steps.

    @tool("How a skill stands", ToolEffect.READS)
    async def skill_status(
        self, context: Context, run: Handle = None, wait_s: WaitForEnd = 0.0
    ) -> str:
        """Say how a run of a skill stands: state, progress, result, also long after.

        Use it to wait for the end.
        """
        found, reader = self._runs.find(run), find_reader(context)
        await found.wait(wait_s=wait_s, on_news=tell_news(context))
        before, self._told = self._told, None
        told = before[2] if before and before[:2] == (reader, found.handle) else ()
        if reader is not None and not found.is_over:
            self._told = reader, found.handle, found.progress.account
        return say_run(found, () if found.is_over else told)

    @tool(
        "Cancel a skill",
        ToolEffect.STOPS,
        leads="Use {stop_robot} instead when anything is urgent.",
    )
    async def cancel_skill(self, run: Handle = None) -> str:
        """Cancel a run of a skill; nothing of it goes on at the robot then."""
        found = self._runs.find(run)
        if found.is_over:
            return f"It was over already, nothing was cancelled.\n{say_run(found)}"
        await found.cancel()
        return say_run(found)


def tell_news(context: Context) -> OnNews:
    """Return the function that reports progress to a caller."""
    told = ""

    async def tell(run: SkillRun) -> None:
        nonlocal told
        signs = f"{say_count(run.n_progress, 'sign')} of progress"
        # Of a mission a step is told once, however long it goes on.
        steps = run.progress.account
        said = f"{run.handle} {run.state}, {steps[-1] if steps else signs}"
        if said != told:
            told = said
            await context.report_progress(run.passed_s, message=said)

    return tell


async def call_skill(
    skill: Skill,
    arguments: Mapping[str, Any],
    *,
    runs: SkillRuns,
    context: Context[Any, Any] | None,
) -> CallToolResult:
    """Run a skill, and answer how it ended or, where it takes long, how its run is called."""
    own, wait_s = dict(arguments), LONGEST_WAIT_S
    try:
        if is_long(skill):
            given = shorten_wait(own.pop(WAIT, WAITS["default"]))
            wait_s = check_value(WAITS, given, where=WAIT, what=skill.spec.name)
        run = await runs.begin(
            skill, own, wait_s=wait_s, on_news=None if context is None else tell_news(context)
        )
    except MapspeakError as error:
        raise ToolError(say_error(error)) from error
    return CallToolResult(content=[TextContent(type="text", text=say_run(run))])


class MissionTools:
    """Missions: trees of skills that the server runs by itself."""

    def __init__(self, book: SkillBook) -> None:
        self._book = book

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
        wait_s: WaitForEnd = 10.0,
    ) -> str:
        """Run a tree of steps that may move the robot, by itself, until it ends.

        tree is YAML: a list of steps, done one after the other, each `skill: argument` with its
        options. drive: R3; look: D2 (camera); note: text; wait: seconds; ask: a question, with
        answers: [open, shut], otherwise: shut, within_s: 60; check: or wait_for: (within_s) what
        must hold: {{battery_above: 0.3}}, battery_below, standing: true, in_room: R3, near: W1,
        within_m, event: words, sees: label, time_from: "22:00", time_until, value: "{{door}}"
        with is, above or below; not: true. Other skills are steps, too. `as: door` beside a step
        keeps its result for "{{door.answer}}" later. Steps hold steps: sequence, fallback (until
        one succeeds) and parallel (needs: one) have lists; retry: 3, repeat: 3, timeout_s: 60,
        every_min: 60 (times: 24) and until: {{a condition}} (times) stand beside do: [steps].
        [{{every_min: 60, do: [{{drive: R3}}, {{ask: Is it tidy?, otherwise: no, as: tidy}}]}}]
        """
        if (tree is None) == (name is None):
            raise SkillError("A mission is either a tree or a name.", hint="Give one of them.")
        if name is None:
            mission = self._open({"name": "mission", "within_min": within_min}, tree)
        else:
            mission = self._find_saved(name)
        given = check_arguments(mission.spec.parameters, values or {}, skill=mission.spec.name)
        bounds = await self._check(mission, given)
        told = tell_news(context)
        run = await self._book.runs.begin(mission, given, wait_s=wait_s, on_news=told)
        return f"{say_bounds(mission, bounds)}\n{say_run(run)}"

    @tool("Answer a mission", ToolEffect.REMEMBERS)
    async def answer_mission(
        self, question: QuestionId = None, answer: Answer = None
    ) -> list[str | Image]:
        """Show the question that a mission asks, with its picture, or answer it.

        Look at the picture before you answer; where you cannot tell, leave it to the fallback.
        """
        found = self._book.runs.questions.find(question, client=current_caller().session)
        if answer is not None:
            taken = self._book.runs.questions.answer(found, answer)
            return [f"{found.id} is answered: {taken}."]
        picture = [] if found.picture is None else [show_picture(found.picture)]
        return [say_question(found), *picture]

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
        book = self._book
        if tree is None:
            path = self._find_saved(name).path
            if not correction:
                raise SkillError("Nothing is to be saved.", hint="Give a tree, or a correction.")
            add_correction(path, name, correction)
            told = "Its steps are as before: save a tree that does it, where one can."
            return f"Saved {name} in {path}.\n{told}\n{self._show(name)}"
        book.load_saved()
        book.check_free(name)
        before = book.saved.get(name)
        kept = () if before is None else before.remember
        sentence = sentence or ("" if before is None else before.spec.description)
        written = {
            "name": name,
            "sentence": sentence,
            "arguments": [
                {"name": each, "kind": "text", "most": 200.0}
                | ({} if default is None else {"default": default})
                for each, default in (parameters or {}).items()
            ],
            "within_min": within_min,
            "remember": [*kept, *([correction] if correction else [])],
        }
        await self._check(self._open(written, tree), {})
        self._check_file(path := book.folder / f"{name}.yaml", name)
        filled = {key: each for key, each in written.items() if each not in ("", [])}
        write_skills(path, {"skills": [filled]})
        return f"Saved {name} in {path}.\n{self._show(name)}"

    @tool("Show missions and skills", ToolEffect.READS)
    async def show_missions(
        self, name: SavedName = None, picture: Taken = None
    ) -> str | list[str | Image]:
        """List skills and saved missions, show one as a tree, or a picture that a mission took."""
        if picture is not None:
            kept = self._book.runs.questions.pictures
            if (taken := kept.get(picture.strip().upper())) is None:
                raise SkillError("No such picture.", hint=f"Kept: {', '.join(kept) or 'none'}.")
            return [show_picture(taken)]
        if name is not None:
            return self._show(name)
        self._book.load_saved()
        told = [say_interrupted(self._book.interrupted), say_skills(self._book.skills.values())]
        return "\n".join(filter(None, told))

    @tool("Forget a mission", ToolEffect.REMEMBERS)
    async def forget_mission(self, name: Name) -> str:
        """Forget a saved mission; its file is kept beside as NAME.yaml.forgotten."""
        path = self._find_saved(name).path
        self._check_file(path, name)
        path = set_aside(path)
        self._book.load_saved()
        return f"{name} is forgotten; its file is kept as {path}."

    def _open(self, written: dict[str, JsonValue], tree: object) -> Mission:
        """Return a mission that stands nowhere yet; its tree is put where it is written."""
        written["mission"] = parse_tree(tree) or []
        return self._book.desk.open(OwnersEntry.model_validate(written))

    async def _check(self, mission: Mission, given: Arguments) -> MissionBounds:
        """Return what a mission can do at most; refuse places that are not there."""
        bounds, session = self._book.desk.check(mission), self._book.session
        with suppress(LinkError, MapError):
            world = await session.fetch_world_model()
            parts = ((mission, given), *((part, {}) for part in bounds.parts.values()))
            for each, values in parts:
                await session.compute(partial(self._check_places, world, each, values))
        return bounds

    def _check_places(self, world: WorldModel, mission: Mission, given: Arguments) -> None:
        for step in (each for each in mission.tree.walk() if each.skill):
            if step.skill not in BUILT_IN:
                # What the robot's own skills do is not known: they may learn places.
                return
            named = step.name_arguments(self._book.find(step.skill).spec)
            for place in (named[key] for key in PLACES if key in named):
                if find_names(place) <= given.keys() and (asked := fill_in(place, given)) != AHEAD:
                    try:
                        find_place(world, str(asked))
                    except GoalError as error:
                        said = f"Step {step.number} ({step.skill}): {error.message}"
                        raise SkillError(said, hint=error.hint) from error

    def _check_file(self, path: Path, name: str) -> None:
        """Refuse a file of several missions, or a mission of another file: these are a person's."""
        for each in self._book.saved.values():
            if (each.path == path) != (each.spec.name == name):
                said = f"{each.spec.name} stands in {each.path}, which a person has written."
                raise SkillError(said, hint="Choose another name, or ask for a change of the file.")

    def _find_saved(self, name: str) -> Mission:
        self._book.load_saved()
        if name not in self._book.saved:
            known = ", ".join(self._book.saved) or "none"
            raise SkillError(f"No mission is called {name[:60]!r}.", hint=f"Saved: {known}.")
        return self._book.saved[name]

    def _show(self, name: str) -> str:
        mission = self._find_saved(name)
        return say_mission(mission, self._book.desk.check(mission))
