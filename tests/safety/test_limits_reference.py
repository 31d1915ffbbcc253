"""The documented policy.yaml is one that loads, and names the defaults as they are."""

import dataclasses
import re
from pathlib import Path

from mapspeak.safety import Policy
from mapspeak.safety.policyfile import _PolicyFile, load_policy

PAGE = Path(__file__).parents[2] / "docs" / "howto" / "limits.md"


def examples() -> list[str]:
    return re.findall(r"^```yaml\n(.*?)^```$", PAGE.read_text(), re.MULTILINE | re.DOTALL)


def test_the_documented_values_are_the_defaults_but_for_the_areas(tmp_path: Path) -> None:
    path = tmp_path / "policy.yaml"
    path.write_text(examples()[0])
    policy = load_policy(path)
    assert len(policy.areas) == 2
    assert dataclasses.replace(policy, areas=()) == Policy()


def test_every_key_is_documented() -> None:
    text = examples()[0]
    same_as_publish = {"call", "act", "set_parameter", "skill"}
    assert [key for key in _PolicyFile.model_fields if f"{key}:" not in text] == sorted(
        same_as_publish, key=list(_PolicyFile.model_fields).index
    )
    assert all(key in text for key in same_as_publish)


def test_every_example_loads(tmp_path: Path) -> None:
    path = tmp_path / "policy.yaml"
    for name in ("keepout", "loading"):
        (tmp_path / f"{name}.pgm").write_bytes(b"P5\n2 1\n255\n\x00\xfe")
        (tmp_path / f"{name}.yaml").write_text(
            f"image: {name}.pgm\nresolution: 0.5\norigin: [0, 0, 0]\nnegate: 0\n"
            "occupied_thresh: 0.65\nfree_thresh: 0.25\n"
        )
    for example in examples():
        path.write_text(example)
        load_policy(path)
