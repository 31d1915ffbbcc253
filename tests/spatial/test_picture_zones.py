import math

import numpy as np

from mapspeak.geometry import Point, Pose
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.picture import (
    LegendEntry,
    LegendSample,
    MapLayers,
    PictureRegion,
    RegionLayer,
    Zone,
    Zoom,
    draw_map,
)
from mapspeak.spatial.picture.ink import LABEL_SIZE_PX, NUMBER_SIZE_PX
from mapspeak.spatial.picture.marks import PALETTE
from mapspeak.spatial.picture.regions import ZONE_NUMBER
from seeing import WALL_RGB, colours_at, find_text, is_colour, pixels_of

ZONE_RGB = tuple(PALETTE[ZONE_NUMBER].tolist())
SQUARE = (Point(2.0, 2.0), Point(8.0, 2.0), Point(8.0, 8.0), Point(2.0, 8.0))
HOLE = (Point(4.0, 4.0), Point(6.0, 4.0), Point(6.0, 6.0), Point(4.0, 6.0))
LEGEND = (LegendEntry(sample=LegendSample.ZONE, text="closed"),)


def floor() -> OccupancyGrid:
    """Gives a floor of 10 m by 10 m with a wall across it at x = 3 m."""
    cells = np.zeros((100, 100), dtype=np.int8)
    cells[:, 30] = 100
    return OccupancyGrid(cells=cells, resolution_m=0.1, origin=Pose(0.0, 0.0))


def lattice(low: float, high: float) -> np.ndarray:
    along = np.arange(low, high, 0.02)
    return np.stack([each.ravel() for each in np.meshgrid(along, along)], axis=1)


def layers(*outlines: tuple[Point, ...]) -> MapLayers:
    return MapLayers(zones=(Zone(outlines=outlines, label="stairs"),), legend=LEGEND)


def test_a_zone_is_hatched_where_it_is_and_nowhere_else() -> None:
    picture = draw_map(floor(), layers=layers(SQUARE, HOLE))
    inside = is_colour(colours_at(picture, lattice(6.2, 7.8)), ZONE_RGB)
    in_hole = is_colour(colours_at(picture, lattice(4.2, 5.8)), ZONE_RGB)
    outside = is_colour(colours_at(picture, lattice(8.2, 9.8)), ZONE_RGB)
    border = np.array([[x, 2.0] for x in np.arange(5.0, 7.8, 0.05)])
    assert 0.1 < inside.mean() < 0.3
    assert not in_hole.any()
    assert not outside.any()
    assert is_colour(colours_at(picture, border), ZONE_RGB).all()


def test_a_zone_hides_no_wall() -> None:
    bare = pixels_of(draw_map(floor()))
    zoned = pixels_of(draw_map(floor(), layers=layers(SQUARE)))
    height = min(len(bare), len(zoned)) - 80
    is_wall = is_colour(bare[:height], WALL_RGB)
    drawn_over = is_colour(zoned[:height], ZONE_RGB) & is_wall
    assert is_wall.any()
    assert not drawn_over.any()


def test_a_zone_is_named_and_explained() -> None:
    picture = draw_map(floor(), layers=layers(SQUARE))
    (place,) = find_text(picture, "stairs", LABEL_SIZE_PX)
    x, y = picture.view.points_at(np.array([place]))[0]
    assert 2.0 < x < 8.0
    assert 2.0 < y < 8.0
    assert find_text(picture, "closed", NUMBER_SIZE_PX)
    assert not find_text(draw_map(floor(), layers=MapLayers(legend=LEGEND)), "closed", 14)


def test_a_zone_out_of_sight_is_neither_drawn_nor_explained() -> None:
    zoom = Zoom(centre=Point(9.0, 9.0), radius_m=0.5)
    picture = draw_map(floor(), layers=layers(SQUARE), zoom=zoom)
    assert not is_colour(pixels_of(picture), ZONE_RGB).any()
    assert not find_text(picture, "closed", NUMBER_SIZE_PX)
    assert picture.labels_left_out == ()


def test_zones_turn_with_the_picture() -> None:
    picture = draw_map(floor(), layers=layers(SQUARE), up_rad=math.radians(30))
    inside = is_colour(colours_at(picture, lattice(4.0, 6.0)), ZONE_RGB)
    outside = is_colour(colours_at(picture, lattice(8.2, 9.8)), ZONE_RGB)
    assert inside.mean() > 0.05
    assert not outside.any()


def test_a_zone_that_another_one_covers_is_said_to_have_no_label() -> None:
    zones = (Zone(outlines=(HOLE,), label="under"), Zone(outlines=(SQUARE,), label="over"))
    picture = draw_map(floor(), layers=MapLayers(zones=zones))
    assert picture.labels_left_out == ("under",)


def test_a_room_below_a_zone_stays_to_be_seen() -> None:
    regions = RegionLayer(
        np.ones((100, 100), dtype=np.uint16), (PictureRegion(label=1, text="R1"),)
    )
    with_zone = MapLayers(regions=regions, zones=(Zone(outlines=(SQUARE,), label="pit"),))
    plain = colours_at(draw_map(floor(), layers=MapLayers(regions=regions)), lattice(6.2, 7.0))
    zoned = colours_at(draw_map(floor(), layers=with_zone), lattice(6.2, 7.0))
    assert (plain == zoned).all(axis=-1).mean() > 0.5
