"""Flying where the target will be seen: many sequences of banks, scored by what they would show.

Every decision step the belief is first corrected by the looks since the last sighting that showed
nothing, then thinned, led through the streets of the chart, and searched for the flight from which
most of it is seen over the horizon. Its first second is flown, and the rest is what the next search
has to beat. What a partner on the same target will see by its last plan heard counts for little.
A gimballed camera is led to the middle of what is expected, and flights are scored by that.
"""

import math
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from staniel.city import City
from staniel.datatypes.command import FlyBanks
from staniel.datatypes.equipment import Airframe, Camera
from staniel.datatypes.risk import RiskRegion, region_arrays
from staniel.guidance.config import LookaheadConfig
from staniel.guidance.pursuit import NoFeasibleFlightError, Partner, Pursuit, pursuit_policy
from staniel.kernels.flight import MAX_BANKS
from staniel.kernels.forecast import discredit, forecast, thinned
from staniel.kernels.lookahead import plan
from staniel.kernels.lookout import Eye, roll_out, shade
from staniel.kernels.moves import new_moves
from staniel.kernels.outlook import Outlook, free_shares, new_outlook
from staniel.kernels.risk import Regions
from staniel.kernels.scene import Search
from staniel.kernels.sightlines import Sightlines, new_sightlines

__all__ = ["lookahead", "new_search"]

Floats = NDArray[np.float64]

_HOLD = 1.0  # of each bank [s]
_SAMPLES = 2  # looks in a hold
_STEP = _HOLD / _SAMPLES
_FINEST = 4  # halvings of the way from bank to bank, beyond which it makes no difference
_MISS = 0.1  # probability that a camera misses what it could see
_MOST_LOOKS = 40  # in vain, that are remembered
_OLDEST_PLAN = 6.0  # of a partner that is still counted on [s]
_NO_POINT = (math.nan, math.nan)


@dataclass(slots=True)
class _Memory:
    """What the policy keeps from step to step."""

    sightlines: Sightlines
    eye: Eye
    search: Search
    sequence: Floats
    known: tuple[RiskRegion, ...] = ()
    regions: Regions = field(default_factory=lambda: region_arrays(()))
    rates: Floats = field(default_factory=lambda: np.zeros(0))
    planned: float = -math.inf
    looks: list[tuple[float, ...]] = field(default_factory=list)


@pursuit_policy("lookahead")
def lookahead(pursuit: Pursuit) -> FlyBanks:
    """Fly the sequence of banks that is expected to see the most of the target.

    Raises
    ------
    NoFeasibleFlightError
        Every sequence meets a building of the chart or a no-fly region.
    """
    config, airframe, memory = pursuit.config.lookahead, pursuit.airframe, _memory(pursuit)
    cloud = _thinned(pursuit, memory)
    places = forecast(pursuit.chart.walls, cloud, config.horizon * _SAMPLES, _STEP)
    weights = np.full(places.shape[:2], 1.0 / config.particles)
    _share(pursuit, memory.eye, places, weights)
    sequence, _ = plan(
        pursuit.chart.walls,
        memory.sightlines,
        memory.eye,
        memory.search,
        memory.regions,
        memory.rates,
        np.array(pursuit.pose),
        places,
        weights,
        _left_over(memory, pursuit.time),
    )
    if not sequence.size:
        raise NoFeasibleFlightError(f"no flight of {config.horizon} s is free from {pursuit.pose}")
    memory.sequence, memory.planned = sequence, pursuit.time
    held = tuple(sequence[:MAX_BANKS].tolist())
    soon = places[1 : _SAMPLES + 1].reshape(-1, 2)
    east, north = (soon.sum(axis=0) / len(soon)).tolist()
    return FlyBanks(held, _HOLD, airframe.speed, airframe.altitude, (east, north))


def _memory(pursuit: Pursuit) -> _Memory:
    """The policy's own, with the regions that the agent knows of by now."""
    memory = pursuit.memory.get("lookahead")
    if not isinstance(memory, _Memory):
        camera, config = pursuit.camera, pursuit.config.lookahead
        lines = new_sightlines(pursuit.airframe.altitude, camera.target_height)
        eye = Eye(camera.mounting, camera.half_aperture, camera.range)
        search = new_search(pursuit.chart, pursuit.airframe, eye, camera.target_height, config)
        memory = _Memory(lines, eye, search, np.zeros(config.horizon))
        pursuit.memory["lookahead"] = memory
    if memory.known != pursuit.dangers.regions:
        memory.known, price = pursuit.dangers.regions, pursuit.config.lookahead.exposure
        memory.regions = region_arrays(memory.known)
        rates = [math.inf if one.rate is None else price * one.rate for one in memory.known]
        memory.rates = np.array(rates, dtype=np.float64)
    return memory


def new_search(
    chart: City, airframe: Airframe, eye: Eye, target_height: float, config: LookaheadConfig
) -> Search:
    """What is searched, with its tables: some tenths of a second of work, once a flight."""
    banks = airframe.max_bank * np.linspace(-1.0, 1.0, config.banks)
    speed, roll = airframe.speed, (airframe.roll_gain, math.radians(airframe.max_roll_rate_deg))
    free = free_shares(chart.walls, *chart.size, airframe.altitude, target_height)
    below = airframe.altitude - target_height
    return Search(
        new_moves(
            banks, 1 << min(config.polish, _FINEST), speed, *roll, _STEP, _SAMPLES, eye.mount
        ),
        config.horizon,
        _SAMPLES,
        _STEP,
        config.width,
        config.discount,
        config.effort,
        config.polish,
        _outlook(eye, tuple(free), below, speed, tuple(banks), roll, config.discount),
    )


@lru_cache(maxsize=16)
def _outlook(
    eye: Eye,
    free: tuple[float, ...],
    below: float,
    speed: float,
    banks: tuple[float, ...],
    roll: tuple[float, float],
    discount: float,
) -> Outlook:
    """As `new_outlook`; aircraft that are alike share one. Nobody writes into it."""
    shares, held = np.array(free), np.array(banks)
    return new_outlook(eye, shares, below, speed, held, *roll, _STEP, _SAMPLES, discount)


def _left_over(memory: _Memory, time: float) -> Floats:
    """What is left of the last plan, level at its end; level flight where there is none."""
    size, gone = memory.sequence.size, time - memory.planned
    rest = memory.sequence[min(round(min(gone, size) / _HOLD), size) :]
    return np.concatenate((rest, np.zeros(size - rest.size)))


def _thinned(pursuit: Pursuit, memory: _Memory) -> Floats:
    """Particles of equal weight that stand for the belief, corrected by what was not seen."""
    camera, track = pursuit.camera, pursuit.track
    memory.looks = [look for look in memory.looks if look[0] > track.last_seen]
    if track.last_seen < pursuit.time:
        memory.looks.extend(
            (partner.time, *partner.pose[:5], *point)
            for partner in pursuit.partners
            if partner.time > track.last_seen and (point := _look_of(partner, camera)) is not None
        )
        memory.looks = sorted(set(memory.looks))[-_MOST_LOOKS:]
    particles, weights = pursuit.cloud()
    particles, weights = np.ascontiguousarray(particles), weights.copy()
    discredit(
        pursuit.chart.walls,
        particles,
        weights,
        pursuit.time,
        np.array(memory.looks).reshape(-1, 8),
        camera.mounting,
        camera.target_height,
        camera.half_aperture,
        camera.range,
        _MISS,
    )
    few: Floats = thinned(particles, weights, pursuit.config.lookahead.particles)
    return few


def _look_of(partner: Partner, camera: Camera) -> tuple[float, float] | None:
    """Where a partner looked when it spoke; None where it has a gimbal and did not say.

    It tells where it looks from then on, which a second ago was nearly the same place.
    """
    plan = partner.plan
    if camera.mount == "gimbal":
        return None if plan is None else plan.look
    return _NO_POINT


def _share(pursuit: Pursuit, eye: Eye, places: Floats, weights: Floats) -> None:
    """Take from the weights what the partners will see, as far as their plans are known."""
    airframe, trust = pursuit.airframe, pursuit.config.lookahead.trust
    for partner in pursuit.partners:
        age = pursuit.time - partner.time
        if partner.plan is None or age > _OLDEST_PLAN:
            continue
        poses = roll_out(
            np.array(partner.pose),
            np.array(partner.plan.banks),
            partner.plan.hold,
            age,
            len(places) - 1,
            _STEP,
            airframe.roll_gain,
            math.radians(airframe.max_roll_rate_deg),
        )
        height = pursuit.camera.target_height
        shade(pursuit.chart.walls, eye, poses, places, weights, height, trust)
