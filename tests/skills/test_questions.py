"""Questions of missions: kept in order, answered by those who may."""

import pytest

from mapspeak.errors import SkillError
from mapspeak.skills.runs import Question, QuestionBook


def put(questions: QuestionBook, text: str, *, client: str) -> Question:
    return questions.put({"question": text, "within_s": 9.0}, client=client)


def test_only_the_client_that_runs_a_mission_answers_its_questions_while_it_is_there() -> None:
    questions = QuestionBook()
    asked = put(questions, "Open?", client="one")
    with pytest.raises(SkillError, match="of yours"):
        questions.find(None, client="other")
    with pytest.raises(SkillError, match="of yours"):
        questions.find(asked.id, client="other")
    assert questions.find(None, client="one") is asked
    questions.gone.add("one")
    assert questions.find(None, client="other") is asked


def test_each_client_is_shown_its_own_oldest_question() -> None:
    questions = QuestionBook()
    first = put(questions, "One?", client="one")
    second = put(questions, "Other?", client="other")
    assert questions.find(None, client="other") is second
    assert questions.find(None, client="one") is first
    with pytest.raises(SkillError, match="'Q7'"):
        questions.find("Q7", client="one")
