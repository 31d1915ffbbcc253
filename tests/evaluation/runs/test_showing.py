"""The bars, drawn on a terminal of 78 columns."""

import io

from rich.console import Console

from mapspeak.evaluation.runs.plan import RunPlan
from mapspeak.evaluation.runs.showing import RunBar, TrialBar, build_table, say_result
from mapspeak.evaluation.scores.rows import count_rows
from mapspeak.evaluation.trials import Failure, ToolCall, TrialState, Turn
from reportmaking import make_result, make_trial

COLUMNS = 78
LONG = "a place with a name that is much longer than what is left of any line of a terminal"


def draw(*parts: object, is_coloured: bool = False, width: int = COLUMNS) -> str:
    """Draws what rich draws on a narrow terminal."""
    file = io.StringIO()
    console = Console(
        file=file,
        width=width,
        force_terminal=is_coloured,
        color_system="standard" if is_coloured else None,
    )
    console.print(*parts)
    return file.getvalue().rstrip("\n")


def test_the_bar_of_a_trial_is_one_line_whatever_is_called() -> None:
    with TrialBar(is_quiet=True) as bar:
        lines = []
        for task in ("explore", "smallest-room"):
            bar.begin(task)
            for text in ("R1", LONG):
                call = ToolCall(tool="navigate_to", arguments={"place": text})
                bar.note(Turn(role="agent", call=call))
                bar.note(Turn(role="tool", call=call, text=text))
                lines.append(draw(*bar.progress.get_renderables()))
    assert all("\n" not in line and len(line) <= COLUMNS for line in lines)
    assert {line.index("calls") for line in lines} == {lines[0].index("calls")}
    assert ["1 calls" in lines[0], "2 calls" in lines[1], "1 calls" in lines[2]] == [True] * 3
    assert "navigate_to R1" in lines[0]


def test_the_bar_of_a_run_is_one_line_and_keeps_its_numbers() -> None:
    trials = tuple(make_trial(number, world=LONG) for number in range(1, 13))
    with RunBar(is_quiet=True) as bar:
        bar.begin(RunPlan(trials=trials, versions={}))
        for trial in trials:
            bar.note(make_result(trial))
            line = draw(*bar.progress.get_renderables())
            assert "\n" not in line
            assert f"{bar.n_done}/12" in line
            assert f"{bar.n_done} done" in line


def test_a_result_is_said_in_its_colour() -> None:
    failed = make_result(make_trial(), failure=Failure.WRONG_SIZE)
    broken = make_result(make_trial(), failure=Failure.BROKEN, state=TrialState.CRASHED)
    lines = [draw(say_result(each), is_coloured=True) for each in (failed, broken)]
    lines.insert(0, draw(say_result(make_result(make_trial())), is_coloured=True))
    assert ["\x1b[1;32mdone" in lines[0], "\x1b[1;31mFAILED" in lines[1]] == [True] * 2
    assert "\x1b[1;31mBROKEN" in lines[2]
    plain = "done    Go to the smallest room: It stands in the toilet."
    assert draw(say_result(make_result(make_trial()))) == plain


def test_a_table_for_a_narrow_terminal_cuts_no_word_and_says_what_it_leaves_out() -> None:
    failed = make_result(make_trial(2), failure=Failure.WRONG_SIZE)
    rows = count_rows([make_result(make_trial()), failed])
    narrow, wide = (draw(build_table(rows, width=width), width=width) for width in (60, 180))
    words = ("smallest-room", "1/2", "wrong_size 1", "scripted (script)", "picture-table")
    assert not [word for word in words if word not in narrow or word not in wide]
    assert "wall s" in wide
    assert "Wider" not in wide
    assert "driven m" in narrow.partition("show more:")[2]
    assert max(map(len, narrow.splitlines())) <= 60
