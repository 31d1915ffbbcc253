import math

import pytest

from mapspeak.errors import SemanticMapError
from mapspeak.geometry import Pose
from mapspeak.memory import PictureBook, TakenPicture

HERE = Pose(1.0, 2.0, 0.5)


def taken(
    book: PictureBook, *, data: bytes = b"jpeg", stamp_s: float = 1.0, fov_deg: float | None = 90.0
) -> TakenPicture:
    picture = TakenPicture(
        pose=HERE,
        stamp_s=stamp_s,
        width_px=640,
        horizontal_fov_rad=None if fov_deg is None else math.radians(fov_deg),
    )
    return book.add(picture, data, media_type="image/jpeg")


@pytest.mark.parametrize(
    ("column_px", "bearing_deg"),
    [(320, 0.0), (0, 45.0), (640, -45.0), (160, 26.565), (480, -26.565)],
)
def test_a_column_is_a_bearing_through_a_pinhole(column_px: float, bearing_deg: float) -> None:
    picture = taken(PictureBook())

    assert math.degrees(picture.bearing_of(column_px)) == pytest.approx(bearing_deg, abs=1e-3)


@pytest.mark.parametrize("column_px", [-1.0, 640.5, 1e9])
def test_a_column_outside_the_picture_is_refused_with_its_width(column_px: float) -> None:
    with pytest.raises(SemanticMapError, match=r"outside P1, which is 640 px wide"):
        taken(PictureBook()).bearing_of(column_px)


def test_a_camera_that_does_not_say_how_wide_it_looks_has_no_bearings() -> None:
    with pytest.raises(SemanticMapError, match="bearing_deg instead"):
        taken(PictureBook(), fov_deg=None).bearing_of(320)


def test_pictures_are_numbered_and_found_by_id_or_name() -> None:
    book = PictureBook()
    assert book.latest is None
    first, second = taken(book), taken(book)

    assert (first.id, second.id) == ("P1", "P2")
    assert book.latest == second
    assert book.find("p1") == book.find("picture P1 ") == book.find(first.name) == first
    assert book.find("P3") is None


def test_the_name_of_a_picture_is_its_own_in_every_run() -> None:
    once, again = taken(PictureBook()), taken(PictureBook(), stamp_s=2.0)

    assert once.id == again.id
    assert once.name != again.name
    assert once.name.startswith("P1-")
    assert once.name.endswith(".jpg")


def test_old_pictures_are_forgotten() -> None:
    book = PictureBook()
    for _ in range(2100):
        taken(book)

    assert book.find("P1") is None
    assert book.find("P2100") is not None
