"""Many segments in step see what each sees alone; test_sight.py has the exact answers."""

import numpy as np
import pytest
import shapely

from staniel.city import City
from staniel.kernels import walls as sight


def alone(city, a, b):
    """Line of sight of each segment by itself."""
    return [sight.line_of_sight(city.walls, *p, *q) for p, q in zip(a, b, strict=True)]


def mixed_segments(city, n, seed):
    """From in and outside of the city: slanting, level, along axes, upright, above all."""
    rng = np.random.default_rng(seed)
    width, height = city.size
    a = rng.uniform((-60.0, -60.0, 0.0), (width + 60.0, height + 60.0, 90.0), (n, 3))
    b = rng.uniform((0.0, 0.0, 0.0), (width, height, 12.0), (n, 3))
    kind = rng.integers(0, 8, n)
    for axis in range(3):
        a[kind == axis, axis] = b[kind == axis, axis]
    a[kind == 3, :2] = b[kind == 3, :2]
    b[kind == 4, 2] = city.tallest + 5.0
    b[kind == 5] = a[kind == 5]
    return a, b


@pytest.mark.parametrize("n", [0, 1, 2, 127, 128, 129, 256, 1500])
def test_any_number_of_segments(n):
    city = City.generate(size=(300.0, 260.0), seed=2)
    a, b = mixed_segments(city, n, seed=n)
    assert sight.visible_pairs(city.walls, a, b).tolist() == alone(city, a, b)
    assert sight.visible_pairs(city.walls, b, a).tolist() == alone(city, a, b)


@pytest.mark.parametrize(("n", "m"), [(0, 3), (3, 0), (1, 300), (300, 1), (7, 50), (50, 7)])
def test_every_observer_with_every_point(n, m):
    city = City.generate(size=(300.0, 260.0), seed=2)
    a, b = mixed_segments(city, max(n, m), seed=3)
    seen = sight.visible_matrix(city.walls, a[:n], b[:m])
    assert seen.shape == (n, m)
    pairs = sight.visible_pairs(city.walls, np.repeat(a[:n], m, axis=0), np.tile(b[:m], (n, 1)))
    assert np.array_equal(seen.ravel(), pairs)


def test_rays_that_graze_corners_walls_and_roofs():
    """Between the nodes of a chessboard of houses hardly a ray can be decided in float32."""
    rng = np.random.default_rng(4)
    taken = rng.permutation(64)[:30]
    squares = [shapely.box(k % 8, k // 8, k % 8 + 1, k // 8 + 1) for k in taken]
    city = City.from_outlines(squares, rng.integers(1, 5, 30).astype(float), (8.0, 8.0))
    a, b = rng.integers((-1, -1, 0), (10, 10, 6), (2, 3000, 3)).astype(float)
    seen = sight.visible_pairs(city.walls, a, b)
    assert 0.2 < seen.mean() < 0.8
    assert seen.tolist() == alone(city, a, b)
