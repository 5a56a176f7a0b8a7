"""Sightings and tracks to and from Stone Soup's detections and tracks; needs ``stonesoup``.

Stone Soup's state is here always x, vx, y, vy [m, m/s], east and north, and a detection measures
its components 0 and 2. Its timestamps are dates: time 0 s is `EPOCH` unless an epoch is given, and
a timestamp holds whole microseconds. Stone Soup is imported at the first call only.
"""

import itertools
from collections.abc import Iterable, Sequence
from datetime import datetime, timedelta
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from staniel.datatypes.belief import Pose, Sighting, TrackEstimate, TrackId
from staniel.datatypes.checks import checked_covariance
from staniel.errors import StanielError

if TYPE_CHECKING:
    from stonesoup.types.detection import Detection
    from stonesoup.types.track import Track

__all__ = ["EPOCH", "from_detection", "from_track", "to_detection", "to_track", "to_tracks"]

EPOCH: Final = datetime(2000, 1, 1)
"""What time 0 s is called."""

_POSITION, _VELOCITY = (0, 2), (1, 3)


def to_detection(sighting: Sighting, *, epoch: datetime = EPOCH) -> "Detection":
    """Give a sighting as Stone Soup's detection with a linear Gaussian measurement model.

    Parameters
    ----------
    sighting : Sighting
    epoch : datetime
        What time 0 s is called.

    Returns
    -------
    stonesoup.types.detection.Detection
        ``metadata`` has ``reporter`` and ``pose`` of the sighting.

    Raises
    ------
    StanielError
        Stone Soup is not installed, or the time is beyond its calendar.
    """
    _require()
    from stonesoup.models.measurement.linear import LinearGaussian
    from stonesoup.types.detection import Detection

    return Detection(
        sighting.position[:, None].copy(),
        timestamp=_date(sighting.time, epoch),
        measurement_model=LinearGaussian(4, _POSITION, sighting.covariance.copy()),
        metadata={"reporter": sighting.reporter, "pose": sighting.pose},
    )


def from_detection(
    detection: "Detection", *, epoch: datetime = EPOCH, reporter: int = -1
) -> Sighting:
    """Read Stone Soup's detection of a position as a sighting.

    Parameters
    ----------
    detection : stonesoup.types.detection.Detection
        With a linear Gaussian measurement model of the components 0 and 2 of a state of 4.
    epoch : datetime
        What time 0 s is called.
    reporter : int
        Who saw it, where the detection's ``metadata`` does not say.

    Returns
    -------
    Sighting

    Raises
    ------
    StanielError
        A missed detection, no timestamp, no measurement model or one of anything but a Cartesian
        position, a covariance that is not positive definite.
    """
    _require()
    from stonesoup.models.measurement.linear import LinearGaussian
    from stonesoup.types.detection import MissedDetection

    if isinstance(detection, MissedDetection):
        raise StanielError("detection: a missed detection is no sighting")
    model = detection.measurement_model
    if model is None:
        raise StanielError("detection.measurement_model = None: expected one with a covariance")
    if not isinstance(model, LinearGaussian):
        raise StanielError(
            f"detection.measurement_model is {type(model).__name__}: expected LinearGaussian, of a "
            "Cartesian position"
        )
    mapping = tuple(model.mapping)
    if model.ndim_state != 4 or mapping != _POSITION:
        raise StanielError(
            f"detection.measurement_model measures {mapping} of {model.ndim_state} components: "
            f"expected {_POSITION} of 4, the x and y of x, vx, y, vy"
        )
    metadata = detection.metadata
    pose = metadata.get("pose")
    time = _seconds(detection.timestamp, epoch, "detection")
    try:
        return Sighting(
            time,
            np.array(detection.state_vector, dtype=np.float64).ravel(),
            np.array(model.covar(), dtype=np.float64),
            reporter=metadata.get("reporter", reporter),
            pose=pose if isinstance(pose, Pose) else None,
        )
    except ValueError as problem:
        raise StanielError(f"detection: {problem}") from problem


def to_track(
    estimates: Sequence[TrackEstimate], *, velocity_variance: float, epoch: datetime = EPOCH
) -> "Track":
    """Give what a tracker said of one target over time as Stone Soup's track.

    Parameters
    ----------
    estimates : sequence of TrackEstimate
        Of one id, in the order of time; at least one.
    velocity_variance : float [m²/s²]
        Of each component of the velocity, greater than 0: an estimate holds no covariance of it.
        The states have it uncorrelated with the position.
    epoch : datetime
        What time 0 s is called.

    Returns
    -------
    stonesoup.types.track.Track
        Of Gaussian states. Its ``id`` is the name that tables and pictures show; ``metadata`` has
        ``name`` (a `TrackId`), and ``existence`` and ``last_seen`` with one value a state.

    Raises
    ------
    StanielError
        No estimates, several ids, times that do not ascend, a variance that is not positive, or
        Stone Soup is not installed.
    """
    _require()
    from stonesoup.types.state import GaussianState
    from stonesoup.types.track import Track

    names = sorted({estimate.id for estimate in estimates})
    if len(names) != 1:
        raise StanielError(f"estimates are of {len(names)} ids: expected 1")
    times = [estimate.time for estimate in estimates]
    if any(b <= a for a, b in itertools.pairwise(times)):
        raise StanielError(f"estimates have the times {times}: expected ascending ones")
    if not 0.0 < velocity_variance < np.inf:
        raise StanielError(
            f"velocity_variance = {velocity_variance}: expected a finite number greater than 0"
        )
    states = []
    for estimate in estimates:
        mean, covariance = np.empty((4, 1)), velocity_variance * np.eye(4)
        mean[_POSITION, 0], mean[_VELOCITY, 0] = estimate.position, estimate.velocity
        covariance[np.ix_(_POSITION, _POSITION)] = estimate.covariance
        states.append(GaussianState(mean, covariance, timestamp=_date(estimate.time, epoch)))
    metadata = {
        "name": names[0],
        "existence": tuple(estimate.existence for estimate in estimates),
        "last_seen": tuple(estimate.last_seen for estimate in estimates),
    }
    return Track(states, id=str(names[0]), init_metadata=metadata)


def to_tracks(
    estimates: Iterable[TrackEstimate], *, velocity_variance: float, epoch: datetime = EPOCH
) -> "set[Track]":
    """`to_track` of each id among estimates in any order: a set, as Stone Soup's metrics take it.

    Parameters
    ----------
    estimates : iterable of TrackEstimate
        Such as all that a tracker returned, step after step.
    velocity_variance, epoch
        As in `to_track`.

    Returns
    -------
    set of stonesoup.types.track.Track

    Raises
    ------
    StanielError
        As `to_track`.
    """
    of: dict[TrackId, list[TrackEstimate]] = {}
    for estimate in estimates:
        of.setdefault(estimate.id, []).append(estimate)
    return {
        to_track(
            sorted(rows, key=lambda row: row.time),
            velocity_variance=velocity_variance,
            epoch=epoch,
        )
        for rows in of.values()
    }


def from_track(
    track: "Track", *, name: TrackId | None = None, epoch: datetime = EPOCH
) -> list[TrackEstimate]:
    """Read the states of Stone Soup's track as estimates.

    Parameters
    ----------
    track : stonesoup.types.track.Track
        Of states x, vx, y, vy with mean and covariance: Gaussian ones or particles.
    name : TrackId, optional
        What to call it; needed unless the track is one of `to_track`.
    epoch : datetime
        What time 0 s is called.

    Returns
    -------
    list of TrackEstimate
        One a state. Of a track that Stone Soup made, existence is 1 and ``last_seen`` the time of
        the last state up to there that was updated with a measurement, or else of the first state.

    Raises
    ------
    StanielError
        No name, a state without mean, covariance or timestamp, or of another dimension, a
        covariance of the position that is not positive definite.
    """
    _require()
    from stonesoup.types.update import Update

    name = name or track.metadata.get("name")
    if not isinstance(name, TrackId):
        raise StanielError(f"name = {name!r}: expected a TrackId for a track that has none")
    kept = [track.metadata.get(key, ()) for key in ("existence", "last_seen")]
    known = zip(*kept, strict=True) if all(len(k) == len(track.states) for k in kept) else None
    estimates: list[TrackEstimate] = []
    last_seen = None
    for k, state in enumerate(track.states):
        time = _seconds(state.timestamp, epoch, f"state {k}")
        mean, covariance = _moments(state, f"state {k}")
        if last_seen is None or (isinstance(state, Update) and state.hypothesis):
            last_seen = time
        existence, seen = next(known) if known else (1.0, last_seen)
        position, velocity = mean[list(_POSITION)], mean[list(_VELOCITY)]
        estimates.append(TrackEstimate(name, time, position, velocity, covariance, existence, seen))
    return estimates


def _moments(state: Any, where: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:  # noqa: ANN401
    """Mean (4,) of any of Stone Soup's states, and covariance (2, 2) of its position."""
    mean, covariance = (getattr(state, name, None) for name in ("mean", "covar"))
    if mean is None or covariance is None:
        missing = "mean" if mean is None else "covariance"
        raise StanielError(f"{where} is {type(state).__name__}, without {missing}")
    flat = np.array(mean, dtype=np.float64).ravel()
    if flat.shape != (4,):
        raise StanielError(f"{where} has {flat.size} components: expected 4: x, vx, y, vy")
    if not np.isfinite(flat).all():
        raise StanielError(f"{where} has the mean {flat.tolist()}: expected finite numbers")
    block = np.array(covariance, dtype=np.float64)[np.ix_(_POSITION, _POSITION)]
    try:
        return flat, checked_covariance(block, f"{where}, covariance of the position")
    except ValueError as problem:
        raise StanielError(str(problem)) from problem


def _date(time: float, epoch: datetime) -> datetime:
    try:
        return epoch + timedelta(seconds=time)
    except OverflowError as problem:
        raise StanielError(f"time = {time:g} s is beyond the calendar after {epoch}") from problem


def _seconds(date: datetime | None, epoch: datetime, where: str) -> float:
    if date is None:
        raise StanielError(f"{where} has no timestamp")
    if (date.tzinfo is None) != (epoch.tzinfo is None):
        raise StanielError(
            f"{where}: {date} and the epoch {epoch}: expected both with a time zone, or neither"
        )
    return (date - epoch).total_seconds()


def _require() -> None:
    try:
        import stonesoup  # noqa: F401
    except ImportError as problem:
        raise StanielError(
            "Stone Soup is not installed: pip install 'staniel[stonesoup]'"
        ) from problem
