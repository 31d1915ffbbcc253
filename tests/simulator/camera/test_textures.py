import numpy as np
import pytest

from mapspeak.simulator.camera.textures import TILED, draw
from mapspeak.simulator.worlds.models import Surface


@pytest.mark.parametrize("surface", Surface)
def test_every_surface_can_be_drawn(surface: Surface) -> None:
    picture = draw(surface)
    assert picture.dtype == np.uint8
    assert picture.shape[2] == 3
    assert picture.std() > 0.5


@pytest.mark.parametrize("surface", sorted(TILED))
def test_repeated_surfaces_have_no_seam(surface: Surface) -> None:
    picture = draw(surface).astype(float).mean(axis=2)
    seam = np.abs(picture[0] - picture[-1]).mean()
    steps = np.abs(np.diff(picture, axis=0)).mean(axis=1)
    assert seam <= max(3 * steps.mean(), 3.0)
