"""Buildings drawn from a seed keep the laws of a fair world."""

import itertools
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from mapspeak.errors import ConfigError
from mapspeak.simulator import World, load_world, world_names
from mapspeak.simulator.worlds.models import kind_names
from mapspeak.simulator.worlds.worldfiles import parse_world, read_world_text
from mapspeak.spatial.rooms import RoomClass
from tools.worldgen import draw_plan, find_faults, style_names
from tools.worldgen.surfaces import SHIPPED as SURFACES
from tools.worldgen.surfaces import draw_surface, surface_names

SHIPPED = [(style, seed) for style in style_names() for seed in (1, 2)]
MORE_SEEDS = (3, 4)
WAY_M, WIDEST_M = 0.9, 2.4
MOST_BYTES = 300_000


@pytest.mark.parametrize(("style", "seed"), SHIPPED)
def test_the_shipped_worlds_are_those_that_are_drawn(style: str, seed: int) -> None:
    assert draw_plan(style, seed=seed) == read_world_text(f"{style}_{seed}")


@pytest.mark.parametrize(("style", "seed"), list(itertools.product(style_names(), MORE_SEEDS)))
def test_any_seed_gives_a_world_that_keeps_the_laws(style: str, seed: int) -> None:
    world = parse_world(draw_plan(style, seed=seed), name=style)

    assert list(find_faults(world)) == []
    assert all(WAY_M <= door.width_m <= WIDEST_M for door in world.doors)


@pytest.mark.slow
@pytest.mark.parametrize(("style", "seed"), list(itertools.product(style_names(), range(5, 25))))
def test_many_seeds_give_worlds_that_keep_the_laws(style: str, seed: int) -> None:
    assert list(find_faults(parse_world(draw_plan(style, seed=seed), name=style))) == []


@pytest.mark.parametrize(("style", "seed"), SHIPPED)
def test_a_world_has_what_the_papers_tasks_ask_for(style: str, seed: int) -> None:
    world = load_world(f"{style}_{seed}")
    kinds = {thing.kind for thing in world.objects}

    assert {"fire_extinguisher", "charging_dock"} <= kinds
    assert sum(room.room_class is RoomClass.ROOM for room in world.rooms) >= 3
    assert sum(len(room.outline) > 4 for room in world.rooms) >= (style != "flat")


def test_the_drawn_worlds_hold_every_kind_of_thing() -> None:
    worlds = [load_world(f"{style}_{seed}") for style, seed in SHIPPED]

    assert {thing.kind for world in worlds for thing in world.objects} == set(kind_names())


def test_the_drawn_worlds_go_from_a_flat_to_a_large_school() -> None:
    sizes = [_size_m(load_world(f"{style}_{seed}")) for style, seed in SHIPPED]

    assert min(width * height for width, height in sizes) <= 100.0
    assert max(width * height for width, height in sizes) >= 600.0
    assert all(width <= 40.5 and height <= 26.0 for width, height in sizes)


def test_world_files_are_small() -> None:
    assert sum(len(read_world_text(name).encode()) for name in world_names()) <= MOST_BYTES


def test_a_style_that_is_not_there_is_refused_with_those_that_are() -> None:
    with pytest.raises(ConfigError) as caught:
        draw_plan("castle", seed=1)

    assert all(style in caught.value.hint for style in style_names())


def test_two_rooms_of_one_size_break_the_law(tmp_path: Path) -> None:
    alike = tmp_path / "alike.yaml"
    alike.write_text(
        """
        title: Two rooms of one size.
        start: {at: [1, 1]}
        walls: [{line: [[0, 0], [8, 0], [8, 4], [0, 4], [0, 0]]}, {line: [[4, 0], [4, 4]]}]
        doors: [{at: [4, 2], width_m: 1.0}]
        rooms:
          - {name: west, class: room, outline: [[0, 0], [4, 0], [4, 4], [0, 4]]}
          - {name: east, class: room, outline: [[4, 0], [8, 0], [8, 4], [4, 4]]}
        objects: [{name: crate, kind: crate, at: [3.9, 0.5]}]
        """,
        encoding="utf-8",
    )

    faults = list(find_faults(load_world(alike)))

    assert "Two rooms could be the largest." in faults or any("smallest" in f for f in faults)
    assert "The crate stands in a wall." in faults


def test_the_command_writes_the_world_file() -> None:
    command = [sys.executable, "-m", "tools.worldgen", "flat", "--seed", "1"]

    written = subprocess.run(command, capture_output=True, check=True, timeout=120)  # noqa: S603 - our own module

    assert written.stdout.decode() == read_world_text("flat_1")


def _size_m(world: World) -> tuple[float, float]:
    corners = [corner for room in world.rooms for corner in room.outline]
    xs, ys = [corner.x for corner in corners], [corner.y for corner in corners]
    return max(xs) - min(xs), max(ys) - min(ys)


@pytest.mark.parametrize("name", surface_names())
def test_the_shipped_surfaces_are_those_that_are_drawn(name: str) -> None:
    with Image.open(SURFACES / f"{name}.png") as shipped:
        # Versions of Pillow differ by a shade at smooth edges.
        off = np.abs(np.asarray(shipped, np.int16) - np.asarray(draw_surface(name), np.int16))
    assert off.mean() < 1.0
