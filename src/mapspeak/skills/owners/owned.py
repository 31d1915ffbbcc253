"""A skill of skills.yaml: what it calls, with fixed arguments, judged by its result."""

from collections.abc import Awaitable, Callable, Mapping
from dataclasses import replace

from mapspeak.skill import (
    JsonValue,
    OnProgress,
    Skill,
    SkillCode,
    SkillOutcome,
    SkillProgress,
    SkillSpec,
    SkillState,
)
from mapspeak.skills.owners.skillsfile import OwnersEntry

OpenSkill = Callable[[], Awaitable[Skill]]


class OwnedSkill:
    """Calls the interface that its owner named.

    Args:
        entry: As it was written.
        open_called: Finds the called interface at the robot.
        find_skill: Finds the skill whose result is looked at.
    """

    def __init__(
        self, entry: OwnersEntry, open_called: OpenSkill, find_skill: Callable[[str], Skill]
    ) -> None:
        self.entry = entry
        self.open_called = open_called
        self._find_skill = find_skill

    @property
    def spec(self) -> SkillSpec:
        """Its description."""
        return self.entry.spec

    async def run(
        self, arguments: Mapping[str, JsonValue], on_progress: OnProgress
    ) -> SkillOutcome:
        """Call it, and say that it has failed where its owner's condition does not hold.

        Raises:
            MapspeakError: The robot does not offer it, or an argument does not fit there.
        """
        called = await self.open_called()
        renamed = {self.entry.renamed[name]: value for name, value in arguments.items()}
        outcome = await called.run({**self.entry.fixed, **renamed}, on_progress)
        if self.entry.success is None or outcome.state is not SkillState.SUCCEEDED:
            return outcome
        result = outcome.outputs
        if self.entry.judge:
            judged = await self._find_skill(self.entry.judge).run({}, _tell_nobody)
            result = judged.outputs
        if self.entry.success.holds_in(result):
            return outcome
        return replace(outcome, state=SkillState.FAILED, code=SkillCode.NOT_ACHIEVED)


def _tell_nobody(_progress: SkillProgress) -> None:
    """Take the progress of a look at the result."""
