"""What threats and no-fly regions do to what flies: exposure along the true paths."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from staniel.datatypes.risk import RiskConfig, region_arrays
from staniel.kernels.risk import inside_times, near_times

__all__ = ["Exposure", "Hazards"]

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Exposure:
    """What n aircraft went through along a piece of their paths.

    Attributes
    ----------
    risk : (n,) float array
        Sum over the threats of rate times time inside, those that vehicles carry included: the
        exposure of thesis eq. 3.2.
    no_fly : (n,) float array [s]
        Time inside no-fly regions; each region counts for itself, also where two overlap.
    violations : (n,) int array
        How often a no-fly region was entered.
    """

    risk: Floats
    no_fly: Floats
    violations: Indices


class Hazards:
    """The regions and carried threats of a scenario, ready to be flown through.

    Parameters
    ----------
    config : RiskConfig

    Examples
    --------
    Ten seconds at 15 m/s across a disc of 30 m, two units of exposure per second inside:

    >>> from staniel.datatypes.risk import RiskRegion
    >>> disc = RiskRegion(kind="threat", center=(75.0, 0.0), radius=30.0, rate=2.0)
    >>> path = np.zeros((2, 1, 6))
    >>> path[1, 0, 0] = 150.0
    >>> Hazards(RiskConfig(regions=(disc,))).exposure(path, np.zeros((2, 0, 4)), 10.0).risk
    array([8.])
    """

    def __init__(self, config: RiskConfig) -> None:
        regions = config.regions
        self._regions = region_arrays(regions)
        self._rates = np.array([region.rate or 0.0 for region in regions], dtype=np.float64)
        self._forbidden = np.array([region.kind == "no-fly" for region in regions], dtype=np.bool_)
        self._carried = config.carried

    def exposure(self, aircraft: Floats, vehicles: Floats, step: float) -> Exposure:
        """What the aircraft go through between the first and the last instant of their paths.

        A pure function of the true paths: exposures of consecutive pieces that share an instant add
        up, but for an entry where a piece begins inside.

        Parameters
        ----------
        aircraft : (s, n, 6) float array
            As in `Truth.aircraft_path`, or the fine samples of a record; NaN while not in the air.
        vehicles : (s, v, 4) float array
            At the same instants.
        step : float [s]
            Between two instants.

        Returns
        -------
        Exposure
        """
        path = np.ascontiguousarray(aircraft, dtype=np.float64)
        if len(self._rates) > 0:
            seconds, entries = inside_times(path, float(step), self._regions)
        else:  # No reason to load, or on a new machine to compile, the kernel.
            seconds = np.zeros((path.shape[1], 0))
            entries = np.zeros((path.shape[1], 0), dtype=np.int64)
        risk = seconds @ self._rates
        carried, count = self._carried, vehicles.shape[1]
        if carried.active and count:
            who = range(count) if carried.vehicles is None else carried.vehicles
            near = near_times(
                path,
                np.ascontiguousarray(vehicles, dtype=np.float64),
                np.array([k for k in who if k < count], dtype=np.int64),
                carried.radius,
                float(step),
            )
            risk = risk + carried.rate * near
        return Exposure(
            risk, seconds[:, self._forbidden].sum(axis=1), entries[:, self._forbidden].sum(axis=1)
        )
