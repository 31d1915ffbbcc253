"""Questions of missions: kept in order, answered by those who may."""

import pytest

from mapspeak.errors import SkillError
from mapspeak.skills.runs import QuestionBook


def test_only_the_client_that_runs_a_mission_answers_its_questions_while_it_is_there() -> None:
    questions = QuestionBook()
    asked = questions.put("Open?", (), picture=None, client="one", within_s=9.0, otherwise=None)
    with pytest.raises(SkillError, match="of yours"):
        questions.find(None, client="other")
    with pytest.raises(SkillError, match="of yours"):
        questions.find(asked.id, client="other")
    assert questions.find(None, client="one") is asked
    questions.client_is_gone("one")
    assert questions.find(None, client="other") is asked


def test_each_client_is_shown_its_own_oldest_question() -> None:
    questions = QuestionBook()
    first = questions.put("One?", (), picture=None, client="one", within_s=9.0, otherwise=None)
    second = questions.put("Other?", (), picture=None, client="other", within_s=9.0, otherwise=None)
    assert questions.find(None, client="other") is second
    assert questions.find(None, client="one") is first
    with pytest.raises(SkillError, match="'Q7'"):
        questions.find("Q7", client="one")
