import pytest

from mapspeak.geometry import Point
from mapspeak.server.text.world.maps import say_map_warning, say_size
from mapspeak.spatial.mapfiles import MapFileWarning, MapOddity
from mapspeak.spatial.rooms import Region, RoomClass


def region(room_class: RoomClass, *doors: str) -> Region:
    return Region(
        id="R1",
        index=1,
        room_class=room_class,
        free_area_m2=80.0,
        floor_area_m2=90.0,
        length_m=15.52,
        width_m=10.5,
        heading_rad=0.0,
        widest=Point(1.0, 2.0),
        clearance_m=5.01,
        door_ids=doors,
    )


@pytest.mark.parametrize(
    ("told", "words"),
    [
        (region(RoomClass.ROOM, "D1"), "15.5 x 10.5 m, 1 door"),
        (region(RoomClass.CORRIDOR, "D1", "D2"), "15.5 x 10.5 m, 2 doors"),
        (region(RoomClass.OPEN_SPACE), "15.5 x 10.5 m, 0 doors, 10 m wide at the widest"),
    ],
)
def test_a_region_is_told_by_its_size_and_doors(told: Region, words: str) -> None:
    assert say_size(told) == words


@pytest.mark.parametrize(
    ("oddity", "words"),
    [
        (
            MapOddity.UNKNOWN_IS_FREE,
            (
                "1,234 cells (50%) have the grey 205 that map_saver writes for unknown, but load "
                "as free: free_thresh is 0.25. If nobody has seen those places, set "
                "free_thresh: 0.196."
            ),
        ),
        (
            MapOddity.CROSSED_THRESHOLDS,
            (
                "free_thresh 0.25 is not below occupied_thresh 0.2. The usual values are "
                "free_thresh: 0.196 and occupied_thresh: 0.65."
            ),
        ),
        (
            MapOddity.NOTHING_FREE,
            (
                "No cell of the map is free. Check negate and the thresholds: with negate: 0 white "
                "is free."
            ),
        ),
    ],
)
def test_a_warning_says_what_is_odd_and_what_to_change(oddity: MapOddity, words: str) -> None:
    warning = MapFileWarning(
        oddity=oddity, free_thresh=0.25, occupied_thresh=0.2, n_cells=1234, share_ratio=0.5
    )
    assert say_map_warning(warning) == words
