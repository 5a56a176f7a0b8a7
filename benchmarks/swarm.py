"""Simulated targets and what a sensor reports of them: the same for every tracker of a race."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Knowledge", "Swarm", "simulate"]

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Knowledge:
    """What is true of targets and sensor, and told to every tracker.

    Attributes
    ----------
    side : float [m]
        Of the square in which targets start and false alarms fall.
    sigma : float [m]
        Standard deviation of a detection on each axis.
    detection : float
        Probability that a target is detected in a step.
    clutter : float
        Mean number of false alarms in a step, over the square.
    acceleration : float [m²/s³]
        Spectral density of the white acceleration on each axis.
    speed : float [m/s]
        Standard deviation of the first velocity on each axis.
    step : float [s]
    """

    side: float = 1000.0
    sigma: float = 1.5
    detection: float = 0.9
    clutter: float = 5.0
    acceleration: float = 0.05
    speed: float = 2.0
    step: float = 1.0

    @property
    def density(self) -> float:
        """False alarms per step and m²."""
        return self.clutter / self.side**2

    @property
    def noise(self) -> Floats:
        """(2, 2) covariance of a step's noise on position and velocity of one axis."""
        t, q = self.step, self.acceleration
        return q * np.array([[t**3 / 3.0, t**2 / 2.0], [t**2 / 2.0, t]])


@dataclass(frozen=True)
class Swarm:
    """Truth and detections of n steps.

    Attributes
    ----------
    times : (n,) float array [s]
    truth : (n, k, 2) float array [m]
    detections : list of n (m, 2) float arrays [m]
        In no order; nothing tells a false alarm from a target.
    """

    times: Floats
    truth: Floats
    detections: list[Floats]


def simulate(known: Knowledge, targets: int, steps: int, seed: int) -> Swarm:
    """Nearly constant velocities from the first step to the last, detected with noise."""
    rng = np.random.default_rng(seed)
    root = np.linalg.cholesky(known.noise)
    place = rng.uniform(0.0, known.side, (targets, 2))
    velocity = known.speed * rng.standard_normal((targets, 2))
    truth, detections = np.empty((steps, targets, 2)), []
    for k in range(steps):
        if k:
            kick = root @ rng.standard_normal((2, 2 * targets))
            place = place + known.step * velocity + kick[0].reshape(targets, 2)
            velocity = velocity + kick[1].reshape(targets, 2)
        truth[k] = place
        seen = place[rng.random(targets) < known.detection]
        seen = seen + known.sigma * rng.standard_normal(seen.shape)
        false = rng.uniform(0.0, known.side, (rng.poisson(known.clutter), 2))
        detections.append(rng.permutation(np.vstack([seen, false])))
    return Swarm(known.step * np.arange(steps), truth, detections)
