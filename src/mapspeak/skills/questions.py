"""Questions that missions ask a model or a person, with the pictures that they are about."""

from collections import OrderedDict
from dataclasses import dataclass, field

import anyio

from mapspeak.errors import SkillError

MOST_PICTURES = 12


@dataclass(frozen=True, slots=True)
class AskedPicture:
    """A picture that questions may be about.

    Attributes:
        format: Such as "jpeg".
    """

    id: str
    data: bytes
    format: str


@dataclass(eq=False)
class Question:
    """A question that waits.

    Attributes:
        id: Such as "Q1".
        client: The session that may answer it, as long as it is there; empty for anyone.
        picture: Its subject; None where the mission has taken none.
        answer: None until one is given.
    """

    id: str
    text: str
    answers: tuple[str, ...]
    client: str
    picture: AskedPicture | None
    answer: str | None = None
    is_answered: anyio.Event = field(default_factory=anyio.Event)


class QuestionBook:
    """The questions that wait, the oldest first."""

    def __init__(self) -> None:
        self.waiting: list[Question] = []
        self._n_asked = 0
        self._gone: set[str] = set()
        self._pictures: OrderedDict[str, AskedPicture] = OrderedDict()

    def keep(self, picture: AskedPicture) -> None:
        """Keep a picture that a mission has taken."""
        self._pictures[picture.id] = picture
        while len(self._pictures) > MOST_PICTURES:
            self._pictures.popitem(last=False)

    def put(
        self, text: str, answers: tuple[str, ...], *, picture: str | None, client: str
    ) -> Question:
        """Let a question wait, about a picture or the latest."""
        self._n_asked += 1
        latest = next(reversed(self._pictures.values()), None)
        shown = latest if picture is None else self._pictures.get(picture)
        question = Question(f"Q{self._n_asked}", text, answers, client, shown)
        self.waiting.append(question)
        return question

    def client_is_gone(self, client: str) -> None:
        """Let anyone answer what a client would have been asked: its missions go on without it."""
        self._gone.add(client)

    def find(self, question_id: str | None, *, client: str | None) -> Question:
        """Return a question that waits for a client; the oldest unless one is named.

        Args:
            client: Its session; None for a person, who may answer every question.

        Raises:
            SkillError: None waits for it, or not that one.
        """
        open_to = {"", client, *self._gone}
        mine = [
            each
            for each in self.waiting
            if each.answer is None and (client is None or each.client in open_to)
        ]
        for each in mine:
            if question_id is None or each.id == question_id.strip().upper():
                return each
        if mine:
            ids = ", ".join(each.id for each in mine)
            raise SkillError(f"No question {question_id!r} waits.", hint=f"There wait: {ids}.")
        others = "Only the client that runs the mission answers it." if self.waiting else ""
        raise SkillError(
            "No mission waits for an answer of yours." if others else "No mission waits.",
            hint=others or "Nothing was answered.",
        )

    def answer(self, question: Question, answer: str) -> str:
        """Give an answer, and return it as the mission takes it.

        Raises:
            SkillError: It is not one of the accepted answers.
        """
        taken = {each.casefold(): each for each in question.answers}
        said = answer.strip()
        if taken and said.casefold() not in taken:
            raise SkillError(
                f"{question.id} cannot be answered by {said[:60]!r}.",
                hint=f"Give one of: {', '.join(question.answers)}.",
            )
        question.answer = taken.get(said.casefold(), said)
        question.is_answered.set()
        return question.answer
