"""Who may drive where ways come together: a route is claimed as a whole, or waited for outside.

A *stretch* of an arc is contested where somebody on another way would touch who drives there; the
stretches that this comes from are its *rivals*. What follows on a way without a place to wait
between is one *visit*: a junction, a few of them in a row, a narrow street, two roads that cross
on the map only. Who comes so near that it would have to brake claims all stretches of the visit, if
nobody has claimed one of them or of their rivals, nobody is on the way, and behind the visit is
room to stand. So nobody waits where others cross, and who has entered can always leave.

Columns are those of `staniel.kernels.routes`. `claimed` has an element for each stretch: the
vehicle that has claimed it plus 1, or 0. The vehicles on arc a are ``queue[a]``,
``after[queue[a]]`` and so on until -1, modulo their number: who crosses over is on two arcs.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from staniel.kernels.headway import FARTHEST, GAP, behind
from staniel.kernels.pieces import bare
from staniel.kernels.routes import (
    AHEAD,
    CLAIM,
    CLAIMS,
    INSIDE,
    QUIET,
    ROUTE,
    Roads,
    corner_ahead,
    left_on,
    way_left,
)

__all__ = ["all_claims", "claim_speed", "give_back"]

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

_LINE = 0.3  # one waits so far before a visit [m]
_DEEP = 1.0  # who is farther in a visit that is not its own drives on [m]
_FARTHER = 10.0  # than one must, one looks: then not again for a while [m]
_JOIN = 0.75  # stretches this near together are one visit [m]
_ROOM = 1.0  # behind a visit, beside the gap and both bodies [m]


@njit(cache=True, error_model="numpy")
def all_claims(memory: Array, stretches: int) -> Indices:
    """`claimed`, by what the drivers remember."""
    claimed = np.zeros(stretches, dtype=np.int64)
    for i in range(memory.shape[0]):
        for c in range(CLAIM, CLAIM + CLAIMS):
            if memory[i, c] == 0.0:
                break
            claimed[int(memory[i, c]) - 1] = i + 1
    return claimed


@bare
def give_back(memory: Array, i: int, claimed: Indices, begin: int, end: int) -> None:
    """The vehicle's claims from `begin` on and before `end` end; later ones move up."""
    for c in range(CLAIM + begin, CLAIM + CLAIMS):
        if memory[i, c] == 0.0:
            return
        if c < CLAIM + end:
            claimed[int(memory[i, c]) - 1] = 0
        later = c + end - begin
        memory[i, c] = memory[i, later] if later < CLAIM + CLAIMS else 0.0


@bare
def _look_ahead(
    arcs: Indices,
    corners: Array,
    stretch: Indices,
    contested: Array,
    memory: Array,
    i: int,
    left: float,
    horizon: float,
    ids: Indices,
    ways: Array,
) -> tuple[int, float]:
    """Fill in the stretches on the way, and how far away each begins and ends [m].

    Those that begin before `horizon`, and the rest of the last visit. Returns their number, and how
    far the way is known.
    """
    count, start, upto = 0, -math.inf, left
    for k in range(AHEAD - 1):
        if k > 0:
            if start > horizon and (count == 0 or start > ways[count - 1, 1] + _JOIN):
                break
            upto += corners[corner_ahead(arcs, memory, i, k), 3]
        arc = int(memory[i, ROUTE + k])
        corner = upto - corners[corner_ahead(arcs, memory, i, k + 1), 2]
        for s in range(stretch[arc], stretch[arc + 1]):
            begin = max(upto - contested[s, 0], start)
            end = min(upto - contested[s, 1], corner)
            if end <= 0.0 or end < begin:
                continue
            if count == CLAIMS:
                return count, begin
            if begin > horizon and (count == 0 or begin > ways[count - 1, 1] + _JOIN):
                return count, begin
            ids[count], ways[count, 0], ways[count, 1] = s, begin, end
            count += 1
        start = corner
    return count, start


@bare
def _unclaimed(roads: Roads, claimed: Indices, ids: Indices, begin: int, end: int, i: int) -> bool:
    """Whether no other vehicle has claimed one of these stretches, or of their rivals."""
    first, rivals = roads.first_rival, roads.rivals
    for c in range(begin, end):
        s = ids[c]
        if claimed[s] != 0 and claimed[s] != i + 1:
            return False
        for k in range(first[s], first[s + 1]):
            other = claimed[rivals[k]]
            if other != 0 and other != i + 1:
                return False
    return True


@bare
def _way_free(
    roads: Roads,
    vehicles: Array,
    memory: Array,
    queue: Indices,
    after: Indices,
    i: int,
    left: float,
    far: float,
) -> bool:
    """Whether nobody is on the first `far` metres of the vehicle's way."""
    arcs, ends, corners = roads.arcs, roads.ends, roads.corners
    n, upto = vehicles.shape[0], left
    for k in range(AHEAD):
        if k > 0:
            place = corner_ahead(arcs, memory, i, k)
            if upto - corners[place, 2] > far:
                return True
            upto += corners[place, 3]
        arc = int(memory[i, ROUTE + k])
        entry = queue[arc]
        while entry >= 0:
            j = entry if entry < n else entry - n
            entry = after[entry]
            if j == i:
                continue
            along = upto - left_on(ends, memory, j, arc, vehicles[j, 0], vehicles[j, 1])
            if 0.0 < along < far:
                return False
    return True


@bare
def claim_speed(
    roads: Roads,
    vehicles: Array,
    memory: Array,
    claimed: Indices,
    queue: Indices,
    after: Indices,
    i: int,
    habits: Array,
    dt: float,
    ids: Indices,
    ways: Array,
) -> float:
    """Greatest speed that stops before the first visit that is not the vehicle's own [m/s].

    Claims what it must not stop before any more, and gives back what it has left or does not need
    yet; `ids` and `ways` are scratch.
    """
    brake = habits[3]
    fast = vehicles[i, 3] + brake * dt
    horizon = 0.5 * fast * fast / brake + fast * dt + 2.0 * _LINE
    # Round a corner the way is up to 4/π longer than what one drives.
    memory[i, QUIET] -= 1.3 * fast * dt
    if memory[i, QUIET] > horizon:
        return math.inf
    seen = horizon if memory[i, CLAIM] > 0.0 else horizon + _FARTHER
    left = way_left(roads.ends, memory, i, vehicles[i, 0], vehicles[i, 1])
    count, known = _look_ahead(
        roads.arcs,
        roads.corners,
        roads.stretch,
        roads.contested,
        memory,
        i,
        left,
        seen,
        ids,
        ways,
    )
    memory[i, QUIET] = ways[0, 0] if count > 0 else known
    memory[i, INSIDE] = 1.0 if count > 0 and ways[0, 0] <= 0.0 else 0.0
    while memory[i, CLAIM] > 0.0 and (count == 0 or memory[i, CLAIM] != ids[0] + 1.0):
        give_back(memory, i, claimed, 0, 1)
    c = 0
    while c < count:
        d = c + 1
        while d < count and ways[d, 0] <= ways[d - 1, 1] + _JOIN:
            d += 1
        begin, end = ways[c, 0], ways[d - 1, 1]
        if memory[i, CLAIM + d - 1] != ids[d - 1] + 1.0:
            most = behind(0.0, begin - _LINE, brake, dt) if begin > -_DEEP else math.inf
            if begin > 0.0:
                give_back(memory, i, claimed, c, CLAIMS)
                if most > fast or begin > FARTHEST:
                    return most
            if not _unclaimed(roads, claimed, ids, c, d, i):
                return most
            far = end + 2.0 * habits[0] + GAP + _ROOM
            if begin > -_DEEP and not _way_free(
                roads, vehicles, memory, queue, after, i, left, far
            ):
                return most
            for e in range(c, d):
                claimed[ids[e]] = i + 1
                memory[i, CLAIM + e] = ids[e] + 1.0
        c = d
    give_back(memory, i, claimed, c, CLAIMS)
    # The way is not known farther than that.
    return behind(0.0, known, brake, dt)
