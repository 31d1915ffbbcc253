"""In which order things come that a request may mean as well as each other."""

import math

from hypothesis import given, settings
from hypothesis import strategies as st

from drawing import grid_from_text
from mapspeak.geometry import Point, Pose
from mapspeak.memory import SemanticMap
from mapspeak.places.asking import RecallQuery, recall
from mapspeak.places.candidate import RecallCandidate
from mapspeak.worldmodel.model import WorldModel
from remembering import look

# The way into the eastern room is long: what is near through its wall is far by path.
TWO_ROOMS = """
    ################################
    #..............#...............#
    #..............#...............#
    #..............#...............#
    #..............#...............#
    #..............#...............#
    #..............#...............#
    #..............................#
    #..............................#
    ################################
"""
CELL_M = 0.25
GRID = grid_from_text(TWO_ROOMS, resolution_m=CELL_M)
free_cells = st.tuples(st.integers(1, 8), st.integers(1, 30)).filter(
    lambda cell: bool(GRID.free[cell[0], cell[1]])
)


def ask(cells: list[tuple[int, int]], *, n: int) -> tuple[RecallCandidate, ...]:
    """Asks for a hydrant from the west, where one was seen to the north of each cell."""
    looks = []
    for number, (row, col) in enumerate(cells):
        x, y = (col + 0.5) * CELL_M, (row + 0.5) * CELL_M
        hydrant = ("hydrant", Point(x, y + 0.5))
        looks.append(look(f"place {number}", x, y, hydrant, yaw_deg=90, range_m=0.5))
    world = WorldModel(GRID, Pose(2.0, 1.8, 0.0), SemanticMap(waypoints=tuple(looks)), radius_m=0.2)
    return recall(world, RecallQuery(words="hydrant", n=n)).candidates


@settings(max_examples=10)
@given(st.lists(free_cells, min_size=2, max_size=7, unique=True))
def test_of_several_things_of_one_name_the_nearest_by_path_comes_first(
    cells: list[tuple[int, int]],
) -> None:
    told = ask(cells, n=20)
    ways_m = [math.inf if each.check.path_m is None else each.check.path_m for each in told]
    others_m = ways_m if told[0].trust.ratio < 0.98 else ways_m[1:]
    assert others_m == sorted(others_m)


@settings(max_examples=10)
@given(st.lists(free_cells, min_size=3, max_size=7, unique=True))
def test_who_asks_for_fewer_is_told_the_first_of_those_who_ask_for_all(
    cells: list[tuple[int, int]],
) -> None:
    few, every = ask(cells, n=2), ask(cells, n=20)
    assert [each.id for each in few] == [each.id for each in every[:2]]
