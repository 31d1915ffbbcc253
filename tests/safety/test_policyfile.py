from collections.abc import Callable
from datetime import time
from pathlib import Path

import pytest

from mapspeak.errors import ConfigError
from mapspeak.geometry import Point
from mapspeak.safety import (
    CommandKind,
    Hours,
    Otherwise,
    Policy,
    WhenBusy,
    load_policy,
)
from mapspeak.worldmodel.keepout import ClosedArea


def policy_of(folder: Path, text: str) -> Policy:
    path = folder / "policy.yaml"
    path.write_text(text)
    return load_policy(path)


def test_without_a_line_the_defaults_are_on(tmp_path: Path) -> None:
    assert policy_of(tmp_path, "# nothing yet\n") == Policy()


def test_every_key_reaches_the_policy(tmp_path: Path) -> None:
    policy = policy_of(
        tmp_path,
        """
        read_only: true
        latch_on_stop: true
        when_busy: wait
        speed: {linear_mps: 0.3, angular_radps: 1}
        goals: {known_way: false, clearance_m: 0.1, farthest_m: 20}
        keep_out:
          - {name: stairs, outline: [[1, 2], [3, 2], [3, 4.5]]}
        closed:
          - {name: corridor, region: C1, from: "08:00", until: "14:00", days: [mon, tue]}
        publish: {allow: [/cmd_vel], deny: [/lights], usual_denials: false}
        approval: {drives: true, otherwise: queue}
        rates: {drives_per_minute: 3}
        """,
    )
    assert policy.is_read_only
    assert policy.latches_on_stop
    assert policy.when_busy is WhenBusy.WAIT
    assert policy.speeds.linear_mps == 0.3
    assert (policy.needs_known_way, policy.clearance_m, policy.farthest_m) == (False, 0.1, 20)
    stairs, corridor = policy.areas
    assert stairs.outline == (Point(1, 2), Point(3, 2), Point(3, 4.5))
    assert (corridor.region_id, corridor.hours) == (
        "C1",
        Hours(begins=time(8), ends=time(14), days=frozenset({0, 1})),
    )
    assert policy.patterns[CommandKind.PUBLISH].deny == ("/lights",)
    assert policy.approval.kinds == {CommandKind.DRIVE}
    assert policy.approval.otherwise is Otherwise.QUEUE
    assert policy.rates[CommandKind.DRIVE] == 3


def test_denials_of_ones_own_come_on_top_of_the_usual_ones(tmp_path: Path) -> None:
    policy = policy_of(tmp_path, "publish: {deny: [/lights]}")
    assert policy.patterns[CommandKind.PUBLISH].find_denial("/lights")
    assert policy.patterns[CommandKind.PUBLISH].find_denial("/robot1/goal_pose")
    assert policy.patterns[CommandKind.PUBLISH].find_denial("/cmd_vel") is None


def test_the_usual_denials_can_be_left_away_altogether(tmp_path: Path) -> None:
    policy = policy_of(tmp_path, "act: {usual_denials: false}")
    denial = policy.patterns[CommandKind.ACT].find_denial("/spin", ["nav2_msgs/Spin"])
    assert denial is None


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (
            "read_only: true\nspeeds: {}\n",
            "line 2: 'speeds' is not a key of policy.yaml. Did you mean `speed`",
        ),
        ("speed:\n  linear_mps: 0.5\n  angular: 1\n", "line 3: 'speed.angular' is not a key"),
        ("read_only: yes please\n", "line 1: 'read_only' cannot be 'yes please'"),
        ("read_only: 1\n", "line 1: 'read_only"),
        ("speed:\n  linear_mps: fast\n", "line 2: 'speed.linear_mps' cannot be 'fast'"),
        ("speed:\n  linear_mps: true\n", "line 2: 'speed.linear_mps"),
        ("speed:\n  linear_mps: -1\n", "line 2: 'speed.linear_mps"),
        ("speed:\n  linear_mps: .nan\n", "line 2: 'speed.linear_mps"),
        ("keep_out:\n- name: a\n  outline: [[0, 0], [1, 0]]\n", "line 3: 'keep_out.0.outline"),
        (
            "keep_out:\n- name: a\n  outline: [[0, 0], [1, 0], [1, x]]\n",
            "line 3: 'keep_out.0.outline.2.1' cannot be 'x'",
        ),
        ("keep_out:\n- name: a\n", "line 2: 'keep_out.0"),
        ("keep_out:\n- name: a\n  outline: [[0, 0], [1, 1], [2, 2]]\n", "'a' closes nothing"),
        ("keep_out:\n- name: a\n  outline: [[1, 1], [1, 1], [1, 1]]\n", "'a' closes nothing"),
        ("keep_out:\n- {name: a, region: C1, area: 1}\n", "line 2: 'keep_out.0.area' is not a key"),
        ('closed:\n- {name: a, region: C1, until: "25:00"}\n', "line 2: 'closed.0.until"),
        ("closed:\n- {name: a, region: C1, untill: 8}\n", "Did you mean `until`"),
        ("closed:\n- {name: a, region: C1, days: [monday]}\n", "closed.0.days.0"),
        ("when_busy: queue\n", "line 1: 'when_busy"),
        ("approval: {otherwise: ask}\n", "approval.otherwise"),
        ("rates: {drives_per_minute: 1.5}\n", "rates.drives_per_minute"),
        ("read_only: true\nread_only: false\n", "line 2"),
        ("a: [1\nb: 2\n", "is no YAML"),
        ("- read_only\n", "not a list of keys and values"),
        ("publish: [/cmd_vel]\n", "line 1: 'publish"),
    ],
)
def test_a_mistake_is_named_with_its_line_and_key(tmp_path: Path, text: str, says: str) -> None:
    with pytest.raises(ConfigError) as raised:
        policy_of(tmp_path, text)
    assert says in str(raised.value)
    assert "policy.yaml" in str(raised.value)


def test_what_is_wrong_with_a_list_is_said_in_plain_words(tmp_path: Path) -> None:
    with pytest.raises(ConfigError) as raised:
        policy_of(tmp_path, "keep_out:\n- name: a\n  outline: [[0, 0], [1, 0]]\n")
    assert "it needs at least 3 parts, and has 2." in raised.value.message


def test_a_file_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"missing\.yaml"):
        load_policy(tmp_path / "missing.yaml")
    with pytest.raises(ConfigError, match=r"missing\.yaml cannot be read: No such file"):
        load_policy(tmp_path / "missing.yaml")


def write_mask(folder: Path, rows: str, *, more: str = "origin: [10.0, 5.0, 0.0]") -> None:
    """Draws a mask of half a metre per pixel, # for closed, as map_server keeps it."""
    lines = rows.split()
    pixels = bytes(0 if letter == "#" else 254 for line in lines for letter in line)
    header = f"P5\n{len(lines[0])} {len(lines)}\n255\n".encode()
    (folder / "keepout.pgm").write_bytes(header + pixels)
    (folder / "keepout.yaml").write_text(
        f"image: keepout.pgm\nresolution: 0.5\n{more}\nnegate: 0\n"
        "occupied_thresh: 0.65\nfree_thresh: 0.196\nmode: trinary\n"
    )


def area_of(policy: Policy) -> ClosedArea:
    (rule,) = policy.areas
    return ClosedArea(name=rule.name, outline=rule.outline, further_outlines=rule.further_outlines)


MASKED = "keep_out:\n  - name: machines\n    mask: keepout.yaml\n"


def test_a_mask_closes_its_black_pixels_in_its_own_frame_and_leaves_its_holes_open(
    tmp_path: Path,
) -> None:
    write_mask(tmp_path, ".......  .#####.  .#...#.  .#...#.  .#####.  ......#")
    area = area_of(policy_of(tmp_path, MASKED))
    assert [area.contains(Point(x, 6.25)) for x in (10.25, 10.75, 11.75, 12.75, 13.25)] == [
        False,
        True,
        False,
        True,
        False,
    ]
    assert area.contains(Point(13.25, 5.25))
    assert area.distance_to(Point(11.75, 6.5)) == pytest.approx(0.5 - 0.125)


def test_a_turned_mask_lies_turned_on_the_map(tmp_path: Path) -> None:
    write_mask(tmp_path, "....  ..#.  ....", more="origin: [10.0, 5.0, 1.5707963]")
    area = area_of(policy_of(tmp_path, MASKED))
    assert area.contains(Point(10.0 - 0.75, 5.0 + 1.25))
    assert not area.contains(Point(10.0 + 1.25, 5.0 + 0.75))


@pytest.mark.parametrize(
    ("spoil", "says"),
    [
        (lambda folder: (folder / "keepout.pgm").unlink(), "keepout.pgm is missing"),
        (lambda folder: (folder / "keepout.yaml").unlink(), "keepout.yaml"),
        (lambda folder: (folder / "keepout.pgm").write_bytes(b"P5\n9 9\n255\n.."), "keepout.pgm"),
        (lambda folder: write_mask(folder, "... ..."), "closes nothing"),
        (lambda folder: write_mask(folder, "#..", more="origin: [0.0]"), "origin"),
    ],
)
def test_a_mistake_in_a_mask_is_named_with_its_file_and_the_policys_line(
    tmp_path: Path, spoil: Callable[[Path], object], says: str
) -> None:
    write_mask(tmp_path, "#..")
    spoil(tmp_path)
    with pytest.raises(ConfigError) as raised:
        policy_of(tmp_path, MASKED)
    assert f"{tmp_path / 'policy.yaml'}, line 3: 'keep_out.0.mask'" in str(raised.value)
    assert says in str(raised.value)


def test_an_area_says_why_it_is_closed(tmp_path: Path) -> None:
    text = "keep_out: [{name: pit, region: R1, reason: wet paint}]"
    assert policy_of(tmp_path, text).areas[0].reason == "wet paint"
