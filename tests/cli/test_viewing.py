"""`mapspeak view`: replays, and the live page of running servers."""

from pathlib import Path

import anyio
import anyio.to_thread
import httpx2
import pytest
from click.testing import CliRunner, Result

from fakes import FakeRobot, two_rooms
from guarding import make_guard
from mapspeak.cli import cli
from mapspeak.cli.serving.viewing import make_page
from mapspeak.errors import MapspeakError
from mapspeak.memory import SemanticMapStore
from mapspeak.server.view.calls import CallFeed
from mapspeak.server.view.feed import ViewFeed
from mapspeak.server.view.keys import PageKeys, ViewDesk, ViewRequest
from mapspeak.session import Session
from reportmaking import make_trial, write_trial

PATIENCE_S = 60.0


def view(*arguments: str) -> Result:
    return CliRunner().invoke(cli, ["view", "--no-open", *arguments])


def test_a_runs_folder_gets_its_pages_anew(tmp_path: Path) -> None:
    folder = write_trial(tmp_path, make_trial(1))
    assert view(str(tmp_path)).output.strip() == str(tmp_path / "report.html")
    assert (folder / "replay.html").exists()


def test_a_trials_folder_gets_its_replay(tmp_path: Path) -> None:
    folder = write_trial(tmp_path, make_trial(1))
    assert view(str(folder)).output.strip() == str(folder / "replay.html")
    assert "pictures/003.png" in (folder / "replay.html").read_text()


def test_a_log_gets_its_replay_beside_it(tmp_path: Path) -> None:
    log = tmp_path / "calls.jsonl"
    log.write_text('{"tool": "look_at_map", "text": "Robot: x 1"}\n')
    assert view(str(log)).output.strip() == str(tmp_path / "calls.html")
    assert "Robot: x 1" in (tmp_path / "calls.html").read_text()


def test_a_folder_without_a_run_is_refused(tmp_path: Path) -> None:
    result = view(str(tmp_path))
    assert isinstance(result.exception, MapspeakError)
    assert "holds no run" in str(result.exception)


def test_where_no_server_runs_it_is_said(tmp_path: Path) -> None:
    result = view("--control", str(tmp_path), "--wait-s", "0")
    assert "No server has answered" in str(result.exception)
    assert list((tmp_path / "view").iterdir()) == []


@pytest.mark.anyio
async def test_a_server_without_a_page_opens_one_for_whoever_asks(tmp_path: Path) -> None:
    guard = make_guard(tmp_path)
    robot = FakeRobot(two_rooms())
    session = Session(robot, SemanticMapStore(tmp_path / "m.yaml"), lease_s=60.0, guard=guard)
    page = make_page({"": ViewFeed(session, CallFeed())}, None, tells_token=False)
    with anyio.fail_after(PATIENCE_S):
        async with anyio.create_task_group() as tasks:
            await tasks.start(page.serve)
            request = ViewRequest.leave(guard.hold.folder, "ada")
            control, wait = ("--control", str(guard.hold.folder)), ("--wait-s", "50")
            said = await anyio.to_thread.run_sync(lambda: view(*control, *wait))
            ((url, robots),) = request.answers()
            request.withdraw()
            async with httpx2.AsyncClient(base_url=url) as http:
                headers = {"x-mapspeak-key": request.key}
                free = await http.post("/robots/robot/release", json={}, headers=headers)
                locked = await http.post("/robots/robot/release", json={})
            tasks.cancel_scope.cancel()
    assert robots == "fake robot"
    assert f"fake robot: {url}\n" in said.output
    assert (free.status_code, locked.status_code) == (200, 403)


def test_what_is_no_request_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "view" / "folder.key").mkdir(parents=True)
    (tmp_path / "view" / "odd.key").write_bytes(b"\xff\xfe\x00")
    desk, keys = ViewDesk(tmp_path), PageKeys(lambda _: None)
    for found in desk.find_requests():
        desk.answer(found, keys, robots="hall", url="http://127.0.0.1:1/")
    assert desk.find_requests() == []
    assert list((tmp_path / "view").glob("*.url")) == []


def test_a_request_holds_no_key_and_is_answered_once(tmp_path: Path) -> None:
    request = ViewRequest.leave(tmp_path, "ada\nben")
    desk, keys = ViewDesk(tmp_path), PageKeys(lambda _: None)
    (found,) = desk.find_requests()
    assert request.key not in found.read_text()
    desk.answer(found, keys, robots="hall, yard", url="http://127.0.0.1:1/")
    assert keys.find_name(request.key) == "ada ben"
    assert desk.find_requests() == []
    assert list(request.answers()) == [("http://127.0.0.1:1/", "hall, yard")]
    request.withdraw()
    assert list((tmp_path / "view").iterdir()) == []


def test_a_trials_folder_is_shown_wherever_it_was_moved_to(tmp_path: Path) -> None:
    sent = write_trial(tmp_path / "run", make_trial(1)).rename(tmp_path / "sent")
    assert view(str(sent)).output.strip() == str(sent / "replay.html")
    assert "pictures/003.png" in (sent / "replay.html").read_text()
    assert not (tmp_path / "run" / "trials" / make_trial(1).id).exists()


def test_a_result_that_cannot_be_read_is_told_in_a_line(tmp_path: Path) -> None:
    folder = write_trial(tmp_path, make_trial(1))
    (folder / "result.json").write_text("{")
    result = view(str(folder))
    assert isinstance(result.exception, MapspeakError)
    assert "result.json is no result" in str(result.exception)
