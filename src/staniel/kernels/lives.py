"""Whether a track's target is there at all, for how long it was not seen, and when its time is up.

The two-state Bayes filter of `staniel.tracking.Tracker`, in log odds, for all tracks at once.
"""

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["ended", "live_on", "warm"]

Array = NDArray[Any]

_MOST = math.log(999.0)


@njit(cache=True, error_model="numpy")
def live_on(
    log_odds: Array,
    unseen: Array,
    last_seen: Array,
    rows: Array,
    hits: Array,
    owners: Array,
    sightings: Array,
    told: bool,
    moved: bool,
    hit: float,
    miss: float,
) -> tuple[Array, Array]:
    """Take `n` tracks on by a step, the first three arguments in place.

    Parameters
    ----------
    log_odds : (n,) float64 array
        That the target is there.
    unseen : (n,) int64 array
        Steps since a sighting.
    last_seen : (n,) float64 array [s]
        Time of the newest sighting.
    rows : (n, 10) float64 array
        As `staniel.kernels.particles.settle` gives them. The last column, the log of how likely all
        is that was seen and missed, is without `hit`.
    hits : (n,) int64 array
        Looks that showed the track.
    owners : (m,) int64 array
        Track that each sighting belongs to; less than 0: none.
    sightings : (m, 6) float64 array
        The first column is their time [s]. Whole arrays are taken, since a column of a single row
        is of another type to Numba than one of several.
    told : bool
        Somebody said what was looked at: the likelihood counts without a hit, too.
    moved : bool
        Time has passed since the last step.
    hit, miss : float
        Log of what a hit multiplies the odds by, and of what a step without one does where nobody
        says what was looked at.

    Returns
    -------
    seen : (n,) bool array
        Which tracks own a sighting.
    existence : (n,) float64 array
        Probability that the target is there.
    """
    count = log_odds.size
    seen, existence = np.zeros(count, np.bool_), np.empty(count)
    for j in range(owners.size):
        k = owners[j]
        if k >= 0:
            seen[k] = True
            last_seen[k] = max(last_seen[k], sightings[j, 0])
    for k in range(count):
        if hits[k] > 0 or told:
            log_odds[k] += rows[k, 9] + hits[k] * hit
        elif moved:
            log_odds[k] += miss
        log_odds[k] = min(log_odds[k], _MOST)
        existence[k] = 1.0 / (1.0 + math.exp(-log_odds[k]))
        if seen[k]:
            unseen[k] = 0
        elif moved:
            unseen[k] += 1
    return seen, existence


@njit(cache=True, error_model="numpy")
def ended(
    unseen: Array,
    existence: Array,
    covariances: Array,
    most_unseen: int,
    least_existence: float,
    widest: float,
) -> Array:
    """Which of `n` tracks are to be given up.

    Parameters
    ----------
    unseen, existence : as `live_on` leaves them
    covariances : (n, 4) float64 array [m²]
        Of the place: xx, xy, yx, yy.
    most_unseen : int
        Steps without a sighting after which a track is given up.
    least_existence : float
    widest : float [m]
        Spread along the longer axis beyond which the particles have dispersed.

    Returns
    -------
    (n,) bool array
    """
    out = np.empty(unseen.size, np.bool_)
    for k in range(unseen.size):
        xx, xy, yy = covariances[k, 0], covariances[k, 1], covariances[k, 3]
        square = 0.5 * (xx + yy) + math.hypot(0.5 * (xx - yy), xy)
        out[k] = (
            unseen[k] >= most_unseen or existence[k] < least_existence or square > widest * widest
        )
    return out


def warm() -> None:
    """Compile, or load from the cache, what is called from Python in a flight."""
    odds, unseen, hits = np.zeros(1), np.zeros(1, np.int64), np.ones(1, np.int64)
    rows, values = np.zeros((1, 10)), np.zeros((1, 6))
    _, existence = live_on(
        odds, unseen, odds.copy(), rows, hits, np.zeros(1, np.int64), values, True, True, 1.0, -1.0,
    )  # fmt: skip
    ended(unseen, existence, rows[:, 4:8].copy(), 17, 0.01, 30.0)
