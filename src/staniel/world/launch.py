"""How the team gets into the air: around the city at once, or from the ground one by one."""

import math
from collections.abc import Sequence

import numpy as np
import shapely
from numpy.typing import NDArray

from staniel.angles import wrap
from staniel.city import City
from staniel.datatypes.equipment import Airframe
from staniel.errors import ScenarioError
from staniel.kernels.flight import BANKS, COMMAND_WIDTH
from staniel.world.config import Launch

__all__ = ["Pad", "on_perimeter"]

_INSET = 30.0  # how far inside the city's rectangle the aircraft start [m]
_CLEARANCE = 5.0  # above the tallest roof [m]: from there on the agent steers
_TRIES = 400  # places on the perimeter
_OUTSIDE = 4.0  # turn radii outside of the city
_OVER = 2.0  # above a roof that an aircraft begins over [m]
_CREEP = 0.01  # airspeed of an aircraft that begins to roll on a strip [m/s]
_LIFT_OFF = 0.98  # of the slowest airspeed, which a first-order response may only approach
_STEADY = 1.0  # hold of the one bank of a climb-out [s]: it is held for ever


def on_perimeter(city: City, airframes: Sequence[Airframe]) -> NDArray[np.float64]:
    """Aircraft in the air, spread evenly along the rectangle's perimeter, 30 m inside it.

    One that does not fly above all roofs begins at the next place along the perimeter that is away
    from those before it and has room: the tightest circle around it and two of its radii ahead meet
    no building that reaches up to it. Where there is none, it begins outside of the city.

    Parameters
    ----------
    city : City
    airframes : sequence of Airframe
        One an aircraft.

    Returns
    -------
    (n, 6) float array
        As in `Truth`: counter-clockwise from the south-west corner, level, at cruise speed and
        altitude, heading for the centre.

    Raises
    ------
    ScenarioError
        No such place.
    """
    width, height = city.size
    inset = min(_INSET, 0.25 * width, 0.25 * height)
    states = np.zeros((len(airframes), 6))
    for i, airframe in enumerate(airframes):
        states[i] = _on_perimeter(city, airframe, inset, (i, len(airframes)))
        if airframe.altitude > city.tallest or _clear(city, airframe, states[: i + 1]):
            continue
        for place in range(2 * _TRIES):
            out = inset if place < _TRIES else -_OUTSIDE * airframe.min_turn_radius
            states[i] = _on_perimeter(city, airframe, out, (i, len(airframes)), place / _TRIES)
            if _clear(city, airframe, states[: i + 1]):
                break
        else:
            raise ScenarioError(
                f"aircraft.count = {len(airframes)}: expected so few that each finds a place of "
                f"its own to begin around the city, aircraft {i} found none"
            )
    return states


def _on_perimeter(
    city: City, airframe: Airframe, inset: float, share: tuple[int, int], on: float = 0.0
) -> tuple[float, float, float, float, float, float]:
    """The state of an aircraft that begins at a share of the perimeter, and so much farther on."""
    width, height = city.size
    east, north = width - 2.0 * inset, height - 2.0 * inset
    around = 2.0 * (east + north)
    way = (around * share[0] / share[1] + around * on) % around
    if way < east:
        x, y = way, 0.0
    elif way < east + north:
        x, y = east, way - east
    elif way < 2.0 * east + north:
        x, y = 2.0 * east + north - way, north
    else:
        x, y = 0.0, 2.0 * (east + north) - way
    heading = math.atan2(0.5 * north - y, 0.5 * east - x)
    return inset + x, inset + y, airframe.altitude, heading, 0.0, airframe.speed


def _clear(city: City, airframe: Airframe, states: NDArray[np.float64]) -> bool:
    """Whether the last of some aircraft has room around it and ahead, and others are not near."""
    x, y, z, heading = states[-1, :4].tolist()
    radius = airframe.min_turn_radius
    ahead = (x + 2.0 * radius * math.cos(heading), y + 2.0 * radius * math.sin(heading))
    room = shapely.LineString([(x, y), ahead]).buffer(radius)
    tall = np.flatnonzero(np.asarray(city.heights) + _OVER > z)
    outlines = np.asarray(city.outlines, dtype=object)[tall]
    apart = np.linalg.norm(states[:-1, :3] - states[-1, :3], axis=1)
    return not shapely.intersects(outlines, room).any() and not (apart < 3.0 * radius).any()


class Pad:
    """Launches from the ground, one aircraft after the other.

    Until its time an aircraft stands at its place. Then it flies straight along the launch heading
    and climbs; 5 m above the tallest roof its agent takes over. It does not avoid buildings on the
    way: places are for open ground. A catapult gives it cruise speed and the greatest climb rate at
    once; a hand the slowest airspeed and no climb; on a strip it rolls until it has the slowest
    airspeed. Times count in whole decision steps.

    Parameters
    ----------
    launch : Launch
        From the ground.
    airframes : sequence of Airframe
        One an aircraft.
    tallest : float [m]
        Roof of the city.
    """

    def __init__(self, launch: Launch, airframes: Sequence[Airframe], tallest: float) -> None:
        count = len(airframes)
        self.times = launch.interval * np.arange(count)
        places = np.array([launch.places[i % len(launch.places)] for i in range(count)])
        self.standing = np.zeros((count, 6))
        self.standing[:, :2] = places
        self.standing[:, 3] = float(wrap(math.radians(launch.heading_deg)))
        slowest = np.array([airframe.min_speed for airframe in airframes])
        self._lift_off = _LIFT_OFF * slowest if launch.kind == "strip" else np.zeros(count)
        cruise = np.array([airframe.speed for airframe in airframes])
        self._begin = {
            "hand": slowest,
            "catapult": cruise,
            "strip": np.full(count, _CREEP),
        }[launch.kind]
        most = np.array([airframe.max_climb for airframe in airframes])
        self._climb = most if launch.kind == "catapult" else np.zeros(count)
        # Level wings, at cruise speed, on the way up to the cruise altitude.
        self._climb_out = np.zeros((count, COMMAND_WIDTH))
        self._climb_out[:, 0] = BANKS
        self._climb_out[:, 1] = cruise
        self._climb_out[:, 2] = [airframe.altitude for airframe in airframes]
        self._climb_out[:, 3], self._climb_out[:, 4] = _STEADY, 1.0
        altitude = self._climb_out[:, 2]
        self._handed_over = np.minimum(tallest + _CLEARANCE, 0.5 * (tallest + altitude))

    def let_go(
        self, due: NDArray[np.bool_], aircraft: NDArray[np.float64], climbs: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Launch those that are due.

        Parameters
        ----------
        due : (n,) bool array
        aircraft : (n, 6) float array
        climbs : (n,) float array [m/s]
            Neither is changed.

        Returns
        -------
        aircraft : (n, 6) float array
        climbs : (n,) float array [m/s]
        """
        aircraft, climbs = aircraft.copy(), climbs.copy()
        aircraft[due, 5] = self._begin[due]
        climbs[due] = self._climb[due]
        return aircraft, climbs

    def steer(
        self, rows: NDArray[np.float64], aircraft: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        """Climb out with those that are not above the roofs yet.

        Parameters
        ----------
        rows : (n, COMMAND_WIDTH) float array
            The agents' commands; not changed.
        aircraft : (n, 6) float array

        Returns
        -------
        rows : (n, COMMAND_WIDTH) float array
            To be flown.
        rolling : (n,) bool array
            Those that are on their wheels, where the wind does not carry them.
        """
        low = aircraft[:, 2] < self._handed_over
        rows = np.where(low[:, None], self._climb_out, rows)
        rolling = low & (aircraft[:, 2] <= 0.0) & (aircraft[:, 5] < self._lift_off)
        rows[rolling, 2] = 0.0
        return rows, rolling
