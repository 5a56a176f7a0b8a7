"""Road followers: the city's roads as arcs that their kernel drives on."""

import math

import numpy as np
from numpy.typing import NDArray

from staniel.city import City, RoadNetwork
from staniel.datatypes.clock import Clock
from staniel.errors import ScenarioError
from staniel.kernels import roads as kernel
from staniel.kernels.corners import corners
from staniel.kernels.headway import ASIDE
from staniel.kernels.routes import Roads
from staniel.kernels.settle import settle
from staniel.kernels.walls import Walls
from staniel.world.config import Traffic
from staniel.world.contested import with_stretches
from staniel.world.lanes import entry_speeds, legs_of, may_follow
from staniel.world.traffic import TRIES, speeds

__all__ = ["RoadFollowers", "arcs_of"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_MARGIN = 0.01  # by which a road's middle is clearer of walls than a vehicle needs [m]
_BESIDE = 1.0  # between vehicles on two roads that end and pass beside one another [m]
_STUB = 20.0  # who drove into a shorter dead end would turn round in the junction [m]


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
        drivable = drivable.without_head_on(traffic.lane_offset, 2.0 * traffic.radius + ASIDE)
        drivable = drivable.without_stubs(
            _STUB, 2.0 * (traffic.lane_offset + traffic.radius) + _BESIDE
        )
        if len(drivable.edges) == 0:
            raise ScenarioError(
                f'vehicles.kind = "roads": none of the {len(network.edges)} pieces of road is wide '
                f"enough for vehicles of vehicles.radius = {traffic.radius:g} m and leads back"
            )
        self._city = city
        self._traffic = traffic
        self._clock = clock
        self._key = key
        self._habits = habits(traffic)
        self._roads = arcs_of(drivable, traffic, city.walls)
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


def arcs_of(network: RoadNetwork, traffic: Traffic, walls: Walls) -> Roads:
    """Each piece of road once per direction: where and how fast it is driven, and where alone.

    Parameters
    ----------
    network : RoadNetwork
        From every node another can be reached.
    traffic : Traffic
    walls : Walls
        Of the city.

    Returns
    -------
    Roads
    """
    edges, both = network.edges, network.both_ways
    nodes = np.ascontiguousarray(network.nodes, dtype=np.float64)
    forth, back = np.arange(len(edges)), len(edges) + np.arange(int(both.sum()))
    arcs = np.full((len(forth) + len(back), 5), -1, dtype=np.int64)
    arcs[forth, :2], arcs[back, :2] = edges, edges[both][:, ::-1]
    arcs[forth[both], 2], arcs[back, 2] = back, forth[both]
    leaving = np.argsort(arcs[:, 0], kind="stable").astype(np.int64)
    counts = np.bincount(arcs[:, 0], minlength=len(nodes))
    first = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    arcs[leaving, 3] = np.arange(len(arcs)) - np.repeat(first[:-1], counts)
    along = nodes[arcs[:, 1]] - nodes[arcs[:, 0]]
    length = np.hypot(along[:, 0], along[:, 1])
    ends = np.concatenate([nodes[arcs[:, 1]], along / length[:, None]], axis=1)
    arcs[:, 4], places = corners(walls, nodes, arcs, first, leaving, habits(traffic))
    # Each corner as its arc sees it, and as the arc does that comes next.
    last = np.repeat(np.arange(len(arcs)), counts[arcs[:, 1]])
    then = leaving[np.arange(len(last)) - arcs[last, 4] + first[arcs[last, 1]]]
    short, far = (((ends[a, :2] - places) * ends[a, 2:]).sum(axis=1) for a in (last, then))
    before, after = may_follow(arcs, first, leaving)
    roads = Roads(
        nodes=nodes,
        arcs=arcs,
        ends=ends,
        first=first,
        leaving=leaving,
        entry=np.zeros(len(arcs)),
        corners=np.column_stack([places, short, far - short]),
        stretch=np.zeros(len(arcs) + 1, dtype=np.int64),
        contested=np.zeros((0, 2)),
        first_rival=np.zeros(1, dtype=np.int64),
        rivals=np.zeros(0, dtype=np.int64),
    )
    legs = legs_of(roads, before, after)
    roads = roads._replace(entry=entry_speeds(legs, arcs, traffic))
    return with_stretches(roads, legs, before, after, traffic.radius)


def habits(traffic: Traffic) -> Floats:
    """Row of habits for `staniel.kernels.roads.follow`: see `staniel.kernels.routes`."""
    return np.array(
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
