import numpy as np
import pytest

from mapspeak.geometry import Pose
from mapspeak.simulator.camera.scene import join, triangulate_object
from mapspeak.simulator.worlds.models import Surface
from mapspeak.simulator.worlds.world import WorldObject

SURFACES = tuple(Surface)


def thing(kind: str, pose: Pose) -> WorldObject:
    return WorldObject(name=kind, kind=kind, pose=pose)


@pytest.mark.parametrize(("kind", "is_round"), [("crate", False), ("trash_bin", True)])
def test_curved_faces_shine_and_flat_ones_do_not(kind: str, *, is_round: bool) -> None:
    triangles = triangulate_object(thing(kind, Pose(1.0, 2.0, 0.7)), 0, SURFACES)
    assert triangles.is_round.any() == is_round


def test_a_thing_that_is_turned_and_shifted_has_its_triangles_turned_and_shifted() -> None:
    here = triangulate_object(thing("desk", Pose(0.0, 0.0)), 0, SURFACES)
    there = triangulate_object(thing("desk", Pose(3.0, -2.0, np.pi / 2)), 0, SURFACES)
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    assert there.normals == pytest.approx(here.normals @ turn.T, abs=1e-9)
    assert there.corners == pytest.approx(here.corners @ turn.T + (3.0, -2.0, 0.0), abs=1e-9)


def test_joined_things_share_no_face() -> None:
    pieces = [
        triangulate_object(thing(kind, Pose(float(i), 0.0)), i, SURFACES)
        for i, kind in enumerate(("desk", "trash_bin", "crate"))
    ]
    joined = join(pieces)
    owners = {face: set(joined.owners[joined.faces == face].tolist()) for face in set(joined.faces)}
    assert all(len(each) == 1 for each in owners.values())
    assert len(owners) == sum(len(set(piece.faces.tolist())) for piece in pieces)
