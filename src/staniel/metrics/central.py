"""What one who hears everything at once would believe: the measure of fusion without a centre."""

from dataclasses import replace

import numpy as np

from staniel.datatypes.belief import Pose, Sighting
from staniel.datatypes.truth import FLYING
from staniel.record import TRACK_DTYPE, Record
from staniel.tracking import CameraView, Coverage, Tracker, TrackingConfig

__all__ = ["central_fusion"]

GROUND = -1
"""Agent number of a ground station."""


def central_fusion(record: Record, config: TrackingConfig | None = None) -> Record:
    """The run's record with the tracks of a central tracker in place of the aircraft's own.

    One `Tracker`, the same that each aircraft carries, is given every sighting of every aircraft
    when it was taken, and what each camera looked at: no radio loses or delays anything. All else,
    what was flown too, stays as it was, so that the metrics of both records compare the two ways to
    fuse and nothing else.

    Parameters
    ----------
    record : Record
    config : TrackingConfig, optional
        Not given: that of the run's scenario.

    Returns
    -------
    Record
        Its `tracks` are all of agent -1.

    Examples
    --------
    >>> import tempfile, staniel
    >>> scenario = staniel.load_scenario("village", minutes=0.5)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     record = staniel.fly(scenario, out=folder + "/run").record
    >>> sorted(set(central_fusion(record).tracks["agent"].tolist()))
    [-1]
    """
    scenario = record.scenario
    config = config or TrackingConfig(**scenario["tracking"])
    chart = record.city if scenario.get("chart") == "known" else None
    tracker = Tracker(config, int(scenario["seed"]), founder=GROUND, chart=chart)
    rows = record.sightings
    until = np.searchsorted(rows["time"], record.times + 1e-6).tolist()
    cameras, aims = record.cameras, record.looks(record.times)
    flying = record.condition[:, :, FLYING] > 0.0
    tracks, first = [], 0
    for k, (time, last) in enumerate(zip(record.times.tolist(), until, strict=True)):
        looks = [
            Coverage(
                None,
                CameraView.of(
                    chart, cameras[i], Pose(*record.aircraft[k, i].tolist()), aims[k, i].tolist()
                ),
                config.detection_probability,
            )
            for i in np.flatnonzero(flying[k]).tolist()
            if chart is not None and cameras[i].delay == 0.0
        ]
        sightings = [
            Sighting(
                row["time"], np.array([row["x"], row["y"]]),
                np.array([[row["cxx"], row["cxy"]], [row["cxy"], row["cyy"]]]),
                reporter=int(row["reporter"]),
            )
            for row in rows[first:last]
        ]  # fmt: skip
        first = last
        for track in tracker.step(time, sightings, looks or None):
            (xx, xy), (_, yy) = track.covariance.tolist()
            tracks.append(
                (
                    time, GROUND, str(track.id), *track.position.tolist(),
                    *track.velocity.tolist(), xx, xy, yy, track.existence, track.last_seen,
                )
            )  # fmt: skip
    return replace(record, tracks=np.array(tracks, dtype=TRACK_DTYPE))
