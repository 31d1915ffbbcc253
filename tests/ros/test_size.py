"""How large a robot is, by the parameters of its navigation."""

from typing import Any

import pytest

from mapspeak.errors import LinkError
from mapspeak.ros.discovery.watch import find_radius_m
from mapspeak.ros.messages.fields import Dialect

pytestmark = pytest.mark.anyio
GLOBAL_2 = "/global_costmap/global_costmap"


class Parameters:
    """A connection that knows parameters and nothing else."""

    def __init__(self, values: dict[tuple[str, str], Any], *, is_dead: bool = False) -> None:
        self._values = values
        self._is_dead = is_dead

    async def fetch_nodes(self) -> tuple[str, ...]:
        return tuple({node for node, _ in self._values})

    async def fetch_parameter(self, node: str, name: str) -> Any:  # noqa: ANN401
        if self._is_dead:
            raise LinkError("No answer.", hint="Wait.")
        return self._values.get((node, name))


async def radius(
    values: dict[tuple[str, str], Any],
    dialect: Dialect = Dialect.ROS2,
    *,
    namespace: str = "",
    is_dead: bool = False,
) -> tuple[float, str] | None:
    connection = Parameters(values, is_dead=is_dead)
    return await find_radius_m(connection, dialect, namespace=namespace)  # type: ignore[arg-type]


async def test_nav2_says_the_radius() -> None:
    assert await radius({(GLOBAL_2, "robot_radius"): 0.22}) == (0.22, f"{GLOBAL_2} robot_radius")


async def test_an_outline_counts_before_the_radius_that_nav2_always_has() -> None:
    outline = "[[0.3, 0.4], [0.3, -0.4], [-0.3, -0.4], [-0.3, 0.4]]"
    found = await radius({(GLOBAL_2, "footprint"): outline, (GLOBAL_2, "robot_radius"): 0.1})
    assert found == (0.5, f"{GLOBAL_2} footprint")


async def test_an_empty_outline_is_none() -> None:
    found = await radius({(GLOBAL_2, "footprint"): "[]", (GLOBAL_2, "robot_radius"): 0.1})
    assert found is not None
    assert found[0] == 0.1


async def test_move_base_says_it_below_its_costmap() -> None:
    outline = [[0.3, 0.4], [0.3, -0.4], [-0.3, 0.0]]
    found = await radius({("/move_base", "local_costmap/footprint"): outline}, Dialect.ROS1)
    assert found == (0.5, "/move_base local_costmap/footprint")


async def test_a_robot_in_a_namespace_is_asked_there() -> None:
    found = await radius({(f"/robot1{GLOBAL_2}", "robot_radius"): 0.3}, namespace="/robot1")
    assert found is not None
    assert found[0] == 0.3


@pytest.mark.parametrize("odd", [True, "wide", -1.0, 0, 1e9, float("nan"), None, [[1]], "[[1,"])
async def test_what_is_no_size_is_not_taken_for_one(odd: object) -> None:
    assert await radius({(GLOBAL_2, "robot_radius"): odd, (GLOBAL_2, "footprint"): odd}) is None


async def test_a_node_that_does_not_answer_leaves_the_radius_unknown() -> None:
    assert await radius({(GLOBAL_2, "robot_radius"): 0.22}, is_dead=True) is None
