"""Stone Soup's trackers with the knowledge of the race: Kalman and particle GNN, Kalman JPDA."""

from collections.abc import Callable
from datetime import datetime, timedelta

import numpy as np
from numpy.typing import NDArray
from stonesoup.dataassociator.neighbour import GNNWith2DAssignment
from stonesoup.dataassociator.probability import JPDA
from stonesoup.dataassociator.tree import DetectionKDTreeGNN2D
from stonesoup.deleter.time import UpdateTimeStepsDeleter
from stonesoup.hypothesiser.distance import DistanceHypothesiser
from stonesoup.hypothesiser.probability import PDAHypothesiser
from stonesoup.initiator.simple import GaussianParticleInitiator, MultiMeasurementInitiator
from stonesoup.measures import Mahalanobis
from stonesoup.models.measurement.linear import LinearGaussian
from stonesoup.models.transition.linear import (
    CombinedLinearGaussianTransitionModel,
    ConstantVelocity,
)
from stonesoup.predictor.kalman import KalmanPredictor
from stonesoup.predictor.particle import ParticlePredictor
from stonesoup.resampler.particle import SystematicResampler
from stonesoup.tracker.simple import MultiTargetMixtureTracker, MultiTargetTracker
from stonesoup.types.detection import Detection
from stonesoup.types.state import GaussianState
from stonesoup.updater.kalman import KalmanUpdater
from stonesoup.updater.particle import ParticleUpdater

from swarm import Knowledge, Swarm

__all__ = ["Rival", "jpda", "kalman_gnn", "particle_gnn"]

Floats = NDArray[np.float64]

EPOCH = datetime(2000, 1, 1)
GATE = 4.0
"""Of association [sigma]."""
HITS = 3
"""Detections before a track is reported."""


class Rival:
    """A Stone Soup tracker that takes a swarm's detections step by step."""

    def __init__(self, tracker: MultiTargetTracker | MultiTargetMixtureTracker) -> None:
        self._tracker = tracker

    def step(self) -> None:
        """Take the next step's detections."""
        next(self._tracker)

    def tracks(self) -> tuple[list[str], Floats]:
        """Names and (m, 2) positions [m] of the live tracks."""
        tracks = sorted(self._tracker.tracks, key=lambda track: track.id)
        places = [np.asarray(track.state.mean, float).ravel()[[0, 2]] for track in tracks]
        return [track.id for track in tracks], np.reshape(places, (-1, 2))


def _fed(tracker: type, swarm: Swarm, known: Knowledge, **parts: object) -> Rival:
    model = _measurement(known)
    steps = []
    for time, places in zip(swarm.times.tolist(), swarm.detections, strict=True):
        now = EPOCH + timedelta(seconds=time)
        made = {Detection(row[:, None], timestamp=now, measurement_model=model) for row in places}
        steps.append((now, made))
    rival = tracker(detector=steps, **parts)
    iter(rival)
    return Rival(rival)


def _measurement(known: Knowledge) -> LinearGaussian:
    return LinearGaussian(4, (0, 2), known.sigma**2 * np.eye(2))


def _motion(known: Knowledge) -> CombinedLinearGaussianTransitionModel:
    axis = ConstantVelocity(known.acceleration)
    return CombinedLinearGaussianTransitionModel([axis, axis])


def _gnn(predictor: object, updater: object) -> GNNWith2DAssignment:
    measure = DistanceHypothesiser(predictor, updater, Mahalanobis(), missed_distance=GATE)
    return GNNWith2DAssignment(measure)


def _tree_gnn(predictor: object, updater: object) -> GNNWith2DAssignment:
    """The same pairs found by a search tree: slower among few detections, faster among many."""
    measure = DistanceHypothesiser(predictor, updater, Mahalanobis(), missed_distance=GATE)
    # The farthest pair is `GATE` deviations apart, less than `GATE` variances above 1 m².
    return DetectionKDTreeGNN2D(
        measure, predictor, updater, max_distance_covariance_multiplier=GATE
    )


def _initiator(known: Knowledge, fastest: float, gnn: Callable = _gnn) -> MultiMeasurementInitiator:
    """By Kalman filters: a track after `HITS` detections, with one step missed at most."""
    predictor, updater = KalmanPredictor(_motion(known)), KalmanUpdater(_measurement(known))
    # The velocity is normal with the spread of a uniform one on the disc of the greatest speed.
    spread = (0.5 * fastest) ** 2
    return MultiMeasurementInitiator(
        prior_state=GaussianState([[0], [0], [0], [0]], np.diag([0.0, spread, 0.0, spread])),
        measurement_model=_measurement(known),
        deleter=UpdateTimeStepsDeleter(2),
        data_associator=gnn(predictor, updater),
        updater=updater,
        min_points=HITS,
    )


def kalman_gnn(swarm: Swarm, known: Knowledge, fastest: float, patience: int) -> Rival:
    """Kalman filters and global nearest neighbours; a track goes after `patience` misses."""
    predictor, updater = KalmanPredictor(_motion(known)), KalmanUpdater(_measurement(known))
    return _fed(
        MultiTargetTracker,
        swarm,
        known,
        initiator=_initiator(known, fastest),
        deleter=UpdateTimeStepsDeleter(patience),
        data_associator=_gnn(predictor, updater),
        updater=updater,
    )


def particle_gnn(
    swarm: Swarm, known: Knowledge, fastest: float, patience: int, particles: int
) -> Rival:
    """The same with particle filters, resampled systematically; started from Kalman filters."""
    predictor = ParticlePredictor(_motion(known))
    updater = ParticleUpdater(_measurement(known), SystematicResampler())
    return _fed(
        MultiTargetTracker,
        swarm,
        known,
        initiator=GaussianParticleInitiator(_initiator(known, fastest), particles),
        deleter=UpdateTimeStepsDeleter(patience),
        data_associator=_gnn(predictor, updater),
        updater=updater,
    )


def jpda(swarm: Swarm, known: Knowledge, fastest: float, patience: int) -> Rival:
    """Kalman filters and joint probabilistic data association, for dense clutter."""
    predictor, updater = KalmanPredictor(_motion(known)), KalmanUpdater(_measurement(known))
    hypothesiser = PDAHypothesiser(
        predictor,
        updater,
        clutter_spatial_density=known.density,
        prob_detect=known.detection,
        prob_gate=0.999,
    )
    return _fed(
        MultiTargetMixtureTracker,
        swarm,
        known,
        initiator=_initiator(known, fastest, _tree_gnn),
        deleter=UpdateTimeStepsDeleter(patience),
        data_associator=JPDA(hypothesiser),
        updater=updater,
    )
