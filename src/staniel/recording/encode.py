"""One tick as JSON text, a message a channel: metres to 1 mm, angles to 1e-4 rad, times to 1 µs.

The texts are formatted by hand: printf-style formatting of a whole array costs half of what
rounding it and `json.dumps` cost, and a tick has some 700 numbers.
"""

import math
from collections.abc import Sequence
from functools import cache
from itertools import islice
from typing import Final

import numpy as np
from numpy.typing import NDArray

from staniel.datatypes.belief import Belief, Percept
from staniel.datatypes.clock import Clock
from staniel.datatypes.command import Command, FlyLine, FlyOrbit
from staniel.datatypes.message import (
    COST_TERMS,
    Acknowledge,
    Announce,
    AssistanceEnd,
    AssistanceOffer,
    AssistanceRequest,
    Award,
    Bid,
    Delivery,
    Handover,
    Heartbeat,
    Message,
    Release,
    Revoke,
)
from staniel.datatypes.truth import NOMINAL, Truth
from staniel.record import Frame
from staniel.recording.schemas import MOST_OFFERS

__all__ = ["FINE_STEP", "FineSteps", "encode_tick"]

FINE_STEP: Final = 0.2
"""Longest time between two fine poses [s], unless a dynamics step is longer."""

_AIRCRAFT_ROW = "[%.3f,%.3f,%.3f,%.4f,%.4f,%.3f]"
_VEHICLE_ROW = "[%.3f,%.3f,%.4f,%.3f]"
_AIRCRAFT = '{"id":%d,"x":%%.3f,"y":%%.3f,"z":%%.3f,"heading":%%.4f,"bank":%%.4f,"speed":%%.3f}'
_CONDITION = (
    '{"id":%d,"energy":%.6f,"camera":%s,"radio":%s,"flying":%s,"lost":%s,'
    '"drift_x":%.3f,"drift_y":%.3f,"climb":%.3f,"wind_x":%.3f,"wind_y":%.3f}'
)
_VEHICLE = '{"id":%d,"x":%%.3f,"y":%%.3f,"heading":%%.4f,"speed":%%.3f}'
_SIGHTING = (
    '{"time":%s,"reporter":%d,"x":%.3f,"y":%.3f,"cxx":%.6g,"cxy":%.6g,"cyy":%.6g,"origin":%d}'
)
_REGION = (
    '{"time":%s,"agent":%d,"kind":"region","origin":%d,"x":null,"y":null,'
    '"cxx":null,"cxy":null,"cyy":null}'
)
_CARRIER = (
    '{"time":%s,"agent":%d,"kind":"carrier","origin":%d,"x":%.3f,"y":%.3f,'
    '"cxx":%.6g,"cxy":%.6g,"cyy":%.6g}'
)
_TRACK = (
    '{"agent":%d,"id":"%s","time":%s,"x":%.3f,"y":%.3f,"vx":%.3f,"vy":%.3f,'
    '"cxx":%.6g,"cxy":%.6g,"cyy":%.6g,"existence":%.4f,"last_seen":%s}'
)
_MESSAGE = (
    '{"time":%s,"sender":%d,"sequence":%d,"kind":"%s","target":%s,"winner":%s,"cost":%s,'
    '"x":%s,"y":%s,"receivers":%d,"heard_by":[%s]%s}'
)
_BID = '{"bidder":%d,"cost":%s,"terms":{%s}}'
_OFFER = '{"target":"%s","auctioneer":%d,"cost":%s,"terms":{%s}}'
_LINE = (
    '{"agent":%d,"kind":"line","start":[%.3f,%.3f],"end":[%.3f,%.3f],"speed":%.3f,"altitude":%.3f}'
)
_ORBIT = (
    '{"agent":%d,"kind":"orbit","center":[%.3f,%.3f],"radius":%.3f,"turn":%d,"speed":%.3f,'
    '"altitude":%.3f}'
)
_BANKS = '{"agent":%d,"kind":"banks","banks":[%s],"hold":%s,"speed":%.3f,"altitude":%.3f%s}'
_LOOK = ',"look":[%.3f,%.3f]'
_NOMINAL = np.array(NOMINAL)
_DECISION = '{"agent":%d,"role":"%s","target":%s,"goal":[%.3f,%.3f]}'


class FineSteps:
    """Which dynamics substeps of a tick are recorded as fine poses, and when they were.

    Every `stride`-th substep, the last one included: the longest stride that stays within
    `FINE_STEP` and divides a decision step evenly.
    """

    def __init__(self, clock: Clock) -> None:
        longest = max(1, math.floor(FINE_STEP / clock.dynamics_step + 1e-9))
        self.stride = max(n for n in range(1, longest + 1) if clock.substeps % n == 0)
        self._step = clock.dynamics_step * self.stride

    def times(self, end: float, count: int) -> list[float]:
        """Instants of the last `count` fine poses of the tick that ends at `end` [s]."""
        return [round(end - self._step * back, 6) for back in range(count - 1, -1, -1)]

    def of(self, path: NDArray[np.float64]) -> NDArray[np.float64]:
        """Fine poses in a path of all substeps, (n_substeps, n, columns); the start has one."""
        return path[(len(path) - 1) % self.stride :: self.stride]


def encode_tick(frame: Frame, fine: FineSteps) -> list[tuple[str, str]]:
    """Encode the messages of one tick.

    Returns
    -------
    list of (str, str)
        Topic and JSON text, one for each of `schemas.TICK_TOPICS`; the condition of the aircraft
        where that is not nominal or the wind blows; the threats where any was noticed.
    """
    head = f'{{"tick":{frame.truth.tick},"time":{_time(frame.truth.time)},'
    rows = {
        "sightings": _sightings(frame.percepts, frame.origins),
        "tracks": _tracks(frame.beliefs),
        "messages": [_message(delivery) for delivery in frame.deliveries],
        "commands": [_command(agent, command) for agent, command in enumerate(frame.commands)],
        "decisions": [_decision(agent, belief) for agent, belief in enumerate(frame.beliefs)],
    }
    texts = [("/staniel/truth", f"{head}{_truth(frame.truth, fine)}}}")]
    texts += [
        (f"/staniel/{kind}", f'{head}"{kind}":[{",".join(items)}]}}')
        for kind, items in rows.items()
    ]
    if frame.truth.wind.any() or (frame.truth.condition != _NOMINAL).any():
        conditions = ",".join(_conditions(frame.truth))
        texts.append(("/staniel/condition", f'{head}"aircraft":[{conditions}]}}'))
    if any(frame.noticed):
        threats = ",".join(_threats(frame.percepts, frame.noticed))
        texts.append(("/staniel/threats", f'{head}"threats":[{threats}]}}'))
    return texts


def _time(seconds: float) -> str:
    return repr(round(float(seconds), 6))


def _truth(truth: Truth, fine: FineSteps) -> str:
    aircraft_path, vehicle_path = fine.of(truth.aircraft_path), fine.of(truth.vehicle_path)
    aircraft = _fill(_objects(_AIRCRAFT, len(truth.aircraft)), truth.aircraft)
    vehicles = _fill(_objects(_VEHICLE, len(truth.vehicles)), truth.vehicles)
    times = ",".join(map(repr, fine.times(truth.time, len(aircraft_path))))
    fine_aircraft = _fill(_nested(_AIRCRAFT_ROW, *aircraft_path.shape[:2]), aircraft_path)
    fine_vehicles = _fill(_nested(_VEHICLE_ROW, *vehicle_path.shape[:2]), vehicle_path)
    return (
        f'"aircraft":{aircraft},"vehicles":{vehicles},"fine":{{"times":[{times}],'
        f'"aircraft":{fine_aircraft},"vehicles":{fine_vehicles}}}'
    )


def _conditions(truth: Truth) -> list[str]:
    rows = []
    for agent, row in enumerate(np.hstack([truth.condition, truth.wind]).tolist()):
        energy, *flags, drift_x, drift_y, climb, wind_x, wind_y = row
        words = ["true" if flag else "false" for flag in flags]
        rows.append(_CONDITION % (agent, energy, *words, drift_x, drift_y, climb, wind_x, wind_y))
    return rows


def _fill(template: str, values: NDArray[np.float64]) -> str:
    return template % tuple(values.ravel().tolist())


@cache
def _objects(row: str, count: int) -> str:
    return f"[{','.join(row % identity for identity in range(count))}]"


@cache
def _nested(row: str, steps: int, count: int) -> str:
    step = f"[{','.join([row] * count)}]"
    return f"[{','.join([step] * steps)}]"


def _sightings(percepts: Sequence[Percept], origins: Sequence[tuple[int, ...]]) -> list[str]:
    rows = []
    for agent, (percept, causes) in enumerate(zip(percepts, origins, strict=True)):
        for sighting, origin in zip(percept.sightings, causes, strict=True):
            x, y = sighting.position.tolist()
            (cxx, cxy), (_, cyy) = sighting.covariance.tolist()
            rows.append(_SIGHTING % (_time(sighting.time), agent, x, y, cxx, cxy, cyy, origin))
    return rows


def _threats(percepts: Sequence[Percept], noticed: Sequence[tuple[int, ...]]) -> list[str]:
    rows = []
    for agent, (percept, origins) in enumerate(zip(percepts, noticed, strict=True)):
        regions, carriers = percept.threats.regions, percept.threats.carriers
        now = _time(percept.time)
        rows += [_REGION % (now, agent, origin) for origin in origins[: len(regions)]]
        for carrier, origin in zip(carriers, origins[len(regions) :], strict=True):
            x, y = carrier.position.tolist()
            (cxx, cxy), (_, cyy) = carrier.covariance.tolist()
            rows.append(_CARRIER % (_time(carrier.time), agent, origin, x, y, cxx, cxy, cyy))
    return rows


def _tracks(beliefs: Sequence[Belief]) -> list[str]:
    rows = []
    for agent, belief in enumerate(beliefs):
        for track in belief.tracks:
            (cxx, cxy), (_, cyy) = track.covariance.tolist()
            rows.append(
                _TRACK
                % (
                    agent,
                    track.id,
                    _time(track.time),
                    *track.position.tolist(),
                    *track.velocity.tolist(),
                    cxx,
                    cxy,
                    cyy,
                    track.existence,
                    _time(track.last_seen),
                )
            )
    return rows


def _name(track: object | None) -> str:
    return "null" if track is None else f'"{track}"'


def _metres(value: float) -> str:
    return f"{value:.3f}" if math.isfinite(value) else "null"


def _message(delivery: Delivery) -> str:
    message = delivery.message
    target, winner, cost, x, y = _contents(message)
    return _MESSAGE % (
        _time(message.time),
        message.sender,
        message.sequence,
        message.kind,
        _name(target),
        "null" if winner is None else winner,
        _metres(cost),
        _metres(x),
        _metres(y),
        delivery.receivers,
        ",".join(map(str, delivery.heard_by)),
        _bids(message),
    )


def _bids(message: Message) -> str:
    """What was bid, of an award that tells it and of a bid itself; nothing of other kinds."""
    match message:
        case Award(bids=bids):
            rows = [
                _BID % (bidder, _metres(cost), _terms(terms))
                for bidder, cost, terms in bids[:MOST_OFFERS]
            ]
            return f',"bids":[{",".join(rows)}]'
        case Bid(targets=targets, auctioneers=auctioneers, costs=costs):
            terms = message.terms or ((),) * len(targets)
            offers = zip(targets, auctioneers, costs, terms, strict=True)
            rows = [
                _OFFER % (target, auctioneer, _metres(cost), _terms(parts))
                for target, auctioneer, cost, parts in islice(offers, MOST_OFFERS)
            ]
            return f',"offers":[{",".join(rows)}]'
    return ""


def _terms(terms: Sequence[float]) -> str:
    return ",".join(f'"{name}":{_metres(term)}' for name, term in zip(COST_TERMS, terms))  # noqa: B905


def _contents(message: Message) -> tuple[object | None, int | None, float, float, float]:
    """Target, winner, cost and position of a message; None and NaN where its kind has none."""
    match message:
        case Heartbeat(pose=pose, target=target, cost=cost):
            return target, None, cost, pose.x, pose.y
        case Award(target=target, position=(x, y), winner=winner, cost=cost):
            return target, winner, cost, x, y
        case Announce(target=target, position=(x, y), cost=cost):
            return target, None, cost, x, y
        case Revoke(target=target, position=(x, y), cost=cost):
            return target, None, cost, x, y
        case Bid(targets=(target, *_), costs=(cost, *_)):
            return target, None, cost, math.nan, math.nan
        case Release(target=target, position=(x, y)):
            return target, None, math.nan, x, y
        case Handover(target=target, position=(x, y), cost=cost):
            return target, None, cost, x, y
        case AssistanceRequest(target=target, position=(x, y)):
            return target, None, math.nan, x, y
        case AssistanceOffer(target=target, cost=cost):
            return target, None, cost, math.nan, math.nan
        case Acknowledge(target=target) | AssistanceEnd(target=target):
            return target, None, math.nan, math.nan, math.nan
    return None, None, math.nan, math.nan, math.nan


def _command(agent: int, command: Command) -> str:
    flown = (command.speed, command.altitude)
    if isinstance(command, FlyLine):
        return _LINE % (agent, *command.start, *command.end, *flown)
    if isinstance(command, FlyOrbit):
        return _ORBIT % (agent, *command.center, command.radius, command.turn, *flown)
    banks = ",".join(f"{bank:.4f}" for bank in command.banks)
    look = "" if command.look is None else _LOOK % command.look
    return _BANKS % (agent, banks, _time(command.hold), *flown, look)


def _decision(agent: int, belief: Belief) -> str:
    text = _DECISION % (agent, belief.role, _name(belief.target), *belief.goal)
    return f'{text[:-1]},"guard":"{belief.guard}"}}' if belief.guard else text
