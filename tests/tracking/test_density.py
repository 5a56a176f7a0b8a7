"""Density of a cloud at a place, against SciPy."""

import numpy as np
import pytest
from scipy.stats import norm

from staniel.kernels.association import density_at


@pytest.mark.parametrize("share", [0.0, 0.1])
def test_density_is_the_sum_of_the_particles_gaussians(share):
    g = np.random.default_rng(4)
    state = g.normal(0.0, 6.0, (4, 333)).astype(np.float32)
    weights = g.random(333).astype(np.float32)
    weights /= weights.sum()
    for x, y in ((0.0, 0.0), (7.0, -3.0), (20.0, 5.0)):
        own_x, own_y = (np.sqrt(4.0 + share * plane.astype(float).var()) for plane in state[:2])
        exact = weights @ (norm.pdf(state[0], x, own_x) * norm.pdf(state[1], y, own_y))
        assert density_at(state, weights, x, y, 4.0, 4.0, share) == pytest.approx(exact, rel=1e-4)
