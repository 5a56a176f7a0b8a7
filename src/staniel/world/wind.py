"""The wind: a mean that is the same everywhere, and gusts that each aircraft has for itself."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from staniel.datatypes.clock import Clock
from staniel.datatypes.equipment import Airframe
from staniel.kernels.gusts import blow
from staniel.world.config import Wind

__all__ = ["Air", "dryden", "mean_wind"]

Floats = NDArray[np.float64]

_FOOT = 0.3048
_LOWEST, _HIGHEST = 10.0, 1000.0  # heights for which the low-altitude forms are stated [ft]
_LONG_AGO = 1e12  # a first step so long that gusts are drawn afresh [s]


def mean_wind(wind: Wind) -> Floats:
    """Velocity of the mean wind.

    Returns
    -------
    (2,) float array [m/s]
        East and north.

    Examples
    --------
    A west wind blows to the east:

    >>> mean_wind(Wind(speed=5.0, from_deg=270.0)).round(9).tolist()
    [5.0, 0.0]
    """
    if wind.speed == 0.0:
        return np.zeros(2)
    origin = math.radians(wind.from_deg)
    return np.array([-wind.speed * math.sin(origin), -wind.speed * math.cos(origin)])


def dryden(height: float, speed: float) -> tuple[float, float]:
    r"""Turbulence near the ground by MIL-F-8785C, its low-altitude Dryden model.

    Parameters
    ----------
    height : float [m]
        Above ground; the forms hold from 10 to 1000 ft, beyond which the nearer end is taken.
    speed : float [m/s]
        Of the mean wind, taken for the one at 20 ft, :math:`W_{20}`.

    Returns
    -------
    sigma : float [m/s]
        Intensity of each horizontal component.
    length : float [m]
        Its length scale.

    Notes
    -----
    With h in feet: :math:`\sigma_u = \sigma_v = 0.1 W_{20} / (0.177 + 0.000823 h)^{0.4}` and
    :math:`L_u = L_v = h / (0.177 + 0.000823 h)^{1.2}`.
    """
    feet = min(max(height / _FOOT, _LOWEST), _HIGHEST)
    base = 0.177 + 0.000823 * feet
    return 0.1 * speed / base**0.4, feet / base**1.2 * _FOOT


class Air:
    """What the wind does around each aircraft. Keeps no state: that is in `Truth.wind`.

    The turbulence of one aircraft is independent of another's: they fly farther apart than its
    length scale, or would if they flew well. One aircraft more changes nobody's gusts.

    Parameters
    ----------
    wind : Wind
    airframes : sequence of Airframe
        One an aircraft; their cruise heights give the turbulence.
    clock : Clock
    key : uint64
        Of the stream of the gusts.
    """

    def __init__(
        self, wind: Wind, airframes: Sequence[Airframe], clock: Clock, key: np.uint64
    ) -> None:
        self._clock, self._key, self._gusts = clock, np.uint64(key), wind.gusts
        self._mean = mean_wind(wind)
        turbulence = [dryden(airframe.altitude, wind.speed) for airframe in airframes]
        own = (wind.gust_sigma, wind.gust_length)
        self._sigmas, self._lengths = (
            np.array([row[c] if own[c] is None else own[c] for row in turbulence], dtype=np.float64)
            for c in (0, 1)
        )
        self._steady = np.empty((clock.substeps, len(airframes), 2))
        self._steady[:] = self._mean

    def start(self) -> Floats:
        """Wind around each aircraft at tick 0, (n, 2) float array [m/s]; gusts blow already."""
        calm: Floats = self._steady[0].copy()
        if not self._gusts:
            return calm
        still = np.ones(len(calm))
        first: Floats = blow(
            calm, self._mean, still, self._sigmas, self._lengths, self._key, 0, _LONG_AGO, 1
        )[0]
        return first

    def advance(self, wind: Floats, speeds: Floats, tick: int) -> Floats:
        """Wind around each aircraft in the substeps that follow `tick`.

        Parameters
        ----------
        wind : (n, 2) float array [m/s]
            At `tick`.
        speeds : (n,) float array [m/s]
            Airspeeds there.
        tick : int

        Returns
        -------
        (substeps, n, 2) float array [m/s]
            Not to be written to.
        """
        if not self._gusts:
            return self._steady
        path: Floats = blow(
            wind,
            self._mean,
            np.ascontiguousarray(speeds),
            self._sigmas,
            self._lengths,
            self._key,
            1 + tick * self._clock.substeps,
            self._clock.dynamics_step,
            self._clock.substeps,
        )
        return path
