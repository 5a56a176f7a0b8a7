"""Road followers: the city's roads as arcs that their kernel drives on."""

import math

import numpy as np
from numpy.typing import NDArray

from staniel.city import City, RoadNetwork
from staniel.datatypes.clock import Clock
from staniel.errors import ScenarioError
from staniel.kernels import roads as kernel
from staniel.kernels.routes import SHARP, SLIGHT, Roads, settle
from staniel.world.config import Traffic
from staniel.world.traffic import TRIES, speeds

__all__ = ["RoadFollowers", "arcs_of"]

Floats = NDArray[np.float64]

_MARGIN = 0.01  # by which a road's middle is clearer of walls than a vehicle needs [m]
_ROUNDS = 200  # of the search for entry speeds, which mostly settles in ten


class RoadFollowers:
    """Vehicles on the right-hand side of the city's roads.

    They choose a way at random at every junction, slow down for corners and for whoever is ahead,
    stop now and then, and turn round where nobody gives way. They use the part of the roads on
    which the middle is clear of buildings and everybody can come from everywhere to everywhere.

    Parameters
    ----------
    city : City
        With roads.
    traffic : Traffic
    clock : Clock
    key : uint64
        Of all their draws.

    Raises
    ------
    ScenarioError
        A city without roads, or none of them can be driven.
    """

    def __init__(self, city: City, traffic: Traffic, clock: Clock, key: np.uint64) -> None:
        network: RoadNetwork | None = getattr(city, "roads", None)
        if network is None:
            raise ScenarioError(
                'vehicles.kind = "roads": the city has no roads, expected city.roads (a GeoJSON '
                'file of LineStrings; with city.source = "geojson")'
            )
        drivable = network.clear_of(city, traffic.radius + _MARGIN)
        if len(drivable.edges) == 0:
            raise ScenarioError(
                f'vehicles.kind = "roads": none of the {len(network.edges)} pieces of road is wide '
                f"enough for vehicles of vehicles.radius = {traffic.radius:g} m and leads back"
            )
        self._city = city
        self._traffic = traffic
        self._clock = clock
        self._key = key
        self._habits = np.array(
            [
                traffic.radius,
                traffic.lane_offset,
                math.radians(traffic.turn_rate_deg),
                traffic.max_acceleration,
                traffic.stop_interval,
                traffic.stop_duration,
                traffic.patience,
            ]
        )
        self._roads = arcs_of(drivable, traffic)
        self._speeds = speeds(traffic, key)

    def begin(self) -> tuple[Floats, Floats]:
        """Vehicles at rest on random places of the roads, 2 radii + 1 m apart.

        Raises
        ------
        ScenarioError
            A vehicle for which no place was found.
        """
        kernel.warm()  # here: it compiles for seconds, and few missions have roads
        traffic = self._traffic
        clearance = 2.0 * traffic.radius + 1.0
        vehicles, memory = settle(
            self._city.walls,
            self._roads,
            self._habits,
            traffic.count,
            clearance,
            TRIES,
            self._key,
        )
        if len(vehicles) < traffic.count:
            raise ScenarioError(
                f"vehicle {len(vehicles)} cannot be placed: no free place on the roads found in "
                f"{TRIES} tries, at least {clearance:g} m from other vehicles"
            )
        return vehicles, memory

    def drive(self, vehicles: Floats, memory: Floats, tick: int) -> tuple[Floats, Floats]:
        """See `staniel.kernels.roads.follow`; the draws are counted in the memory."""
        del tick
        return kernel.follow(
            self._city.walls,
            self._roads,
            vehicles,
            memory,
            self._habits,
            self._speeds,
            self._key,
            self._clock.dynamics_step,
            self._clock.substeps,
        )


def arcs_of(network: RoadNetwork, traffic: Traffic) -> Roads:
    """Each piece of road once per direction, and how fast each may be entered.

    Parameters
    ----------
    network : RoadNetwork
        From every node another can be reached.
    traffic : Traffic

    Returns
    -------
    Roads
    """
    edges, both = network.edges, network.both_ways
    forth, back = np.arange(len(edges)), len(edges) + np.arange(int(both.sum()))
    arcs = np.full((len(forth) + len(back), 3), -1, dtype=np.int64)
    arcs[forth, :2], arcs[back, :2] = edges, edges[both][:, ::-1]
    arcs[forth[both], 2], arcs[back, 2] = back, forth[both]
    leaving = np.argsort(arcs[:, 0], kind="stable").astype(np.int64)
    counts = np.bincount(arcs[:, 0], minlength=len(network.nodes))
    first = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    nodes = np.ascontiguousarray(network.nodes, dtype=np.float64)
    return Roads(nodes, arcs, first, leaving, _entry_speeds(nodes, arcs, first, leaving, traffic))


def _entry_speeds(
    nodes: Floats,
    arcs: NDArray[np.int64],
    first: NDArray[np.int64],
    leaving: NDArray[np.int64],
    traffic: Traffic,
) -> Floats:
    """Greatest speed on entering each arc with which every corner after it can be taken.

    The least solution of v² = min over what may follow of min(v_corner, v_next)² + 2 a length.
    """
    along = nodes[arcs[:, 1]] - nodes[arcs[:, 0]]
    length, course = np.hypot(*along.T), np.arctan2(along[:, 1], along[:, 0])
    before = np.repeat(np.arange(len(arcs)), np.diff(first)[arcs[:, 1]])
    choices = [leaving[first[node] : first[node + 1]] for node in arcs[:, 1]]
    after = np.concatenate(choices) if choices else np.zeros(0, dtype=np.int64)
    # One goes back only where there is no other way.
    onward = after != arcs[before, 2]
    onward |= (np.bincount(before[onward], minlength=len(arcs)) == 0)[before]
    before, after = before[onward], after[onward]
    turn = np.abs((course[after] - course[before] + math.pi) % (2.0 * math.pi) - math.pi)
    cut = np.minimum(3.0 * traffic.radius, 0.5 * np.minimum(length[before], length[after]))
    round_it = math.radians(traffic.turn_rate_deg) * cut / np.tan(0.5 * np.clip(turn, 1e-3, 3.1))
    in_place = np.where(turn < SLIGHT, np.inf, 0.0)
    corner = np.where((turn < SHARP) & (cut >= 0.3 * traffic.radius), round_it, in_place)
    entry = np.full(len(arcs), 40.0)
    gain = 2.0 * traffic.max_acceleration * length
    for _ in range(_ROUNDS):
        end = np.full(len(arcs), np.inf)
        np.minimum.at(end, before, np.minimum(corner, entry[after]))
        new = np.minimum(40.0, np.sqrt(end * end + gain))
        if np.array_equal(new, entry):
            break
        entry = new
    return entry
