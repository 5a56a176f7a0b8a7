"""Identity scores against motmetrics and brute force, and cases made by hand."""

import itertools
import math
import warnings

import numpy as np
import pytest

from staniel.metrics import identity_scores

NAMES = ("switches", "fragmentations", "misses", "false_positives")
SHARES = ("mota", "motp", "idp", "idr", "idf1")


def line(*instants):
    """Instants of points on a line, given as {id: x}."""
    return [(list(row), [[x, 0.0] for x in row.values()]) for row in instants]


def random_sequence(seed):
    """Targets that wander, come and go; tracks that follow, swap, vanish and lie."""
    g = np.random.default_rng(seed)
    targets, instants = int(g.integers(0, 6)), int(g.integers(0, 25))
    side = g.uniform(10.0, 60.0)
    places = g.uniform(0.0, side, (targets, 2))
    names = [f"t{k}" for k in range(targets)]
    truth, tracks = [], []
    for k in range(instants):
        places = places + g.normal(0.0, 2.0, places.shape)
        if targets > 1 and g.random() < 0.2:
            a, b = g.choice(targets, 2, replace=False)
            names[a], names[b] = names[b], names[a]
        if targets and g.random() < 0.1:
            names[g.integers(targets)] = f"new-{k}"
        there = np.flatnonzero(g.random(targets) < 0.85)
        seen = np.flatnonzero(g.random(targets) < 0.8)
        false = g.uniform(0.0, side, (g.integers(0, 3), 2))
        truth.append((there.tolist(), places[there]))
        ids = [names[i] for i in seen] + [f"false-{i}" for i in range(len(false))]
        found = np.vstack([places[seen] + g.normal(0.0, 3.0, (len(seen), 2)), false])
        shuffled = g.permutation(len(ids))
        tracks.append(([ids[i] for i in shuffled], found[shuffled]))
    return truth, tracks


def by_motmetrics(truth, tracks, gate):
    motmetrics = pytest.importorskip("motmetrics", reason="motmetrics is of the extra `dev`")
    accumulator = motmetrics.MOTAccumulator(auto_id=True)
    numbers = {}  # it takes no words for ids
    for (targets, x), (names, y) in zip(truth, tracks, strict=True):
        apart = np.linalg.norm(np.reshape(x, (-1, 1, 2)) - np.reshape(y, (1, -1, 2)), axis=2)
        names = [numbers.setdefault(name, len(numbers)) for name in names]
        accumulator.update(targets, names, np.where(apart <= gate, apart, np.nan))
    keys = {
        "switches": "num_switches",
        "fragmentations": "num_fragmentations",
        "misses": "num_misses",
        "false_positives": "num_false_positives",
        **{share: share for share in SHARES},
    }
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        table = motmetrics.metrics.create().compute(accumulator, metrics=list(keys.values()))
    return {name: table[key].iloc[0] for name, key in keys.items()}


@pytest.mark.parametrize("first", range(0, 120, 20))
def test_equals_motmetrics(first):
    for seed in range(first, first + 20):
        truth, tracks = random_sequence(seed)
        if not sum(len(names) for names, _ in truth) or not sum(len(n) for n, _ in tracks):
            continue
        ours, theirs = identity_scores(truth, tracks, gate=8.0), by_motmetrics(truth, tracks, 8.0)
        assert {name: getattr(ours, name) for name in NAMES} == {n: theirs[n] for n in NAMES}, seed
        for share in SHARES:
            expected = theirs[share]
            if math.isnan(expected):
                assert getattr(ours, share) is None, (seed, share)
            else:
                assert getattr(ours, share) == pytest.approx(expected, abs=1e-12), (seed, share)


@pytest.mark.parametrize("seed", range(30))
def test_identity_assignment_is_the_best_of_all(seed):
    truth, tracks = random_sequence(seed)
    shared, objects, predictions = {}, 0, 0
    for (targets, x), (names, y) in zip(truth, tracks, strict=True):
        objects, predictions = objects + len(targets), predictions + len(names)
        for (i, a), (j, b) in itertools.product(
            zip(targets, x, strict=True), zip(names, y, strict=True)
        ):
            if math.dist(a, b) <= 8.0:
                shared[i, j] = shared.get((i, j), 0) + 1

    def best(targets, taken):
        if not targets:
            return 0
        first, *rest = targets
        ways = [best(rest, taken)]
        ways += [
            count + best(rest, taken | {j})
            for (i, j), count in shared.items()
            if i == first and j not in taken
        ]
        return max(ways)

    lasting = best(sorted({i for i, _ in shared}), frozenset())
    scores = identity_scores(truth, tracks, gate=8.0)
    if objects and predictions:
        assert scores.idr == pytest.approx(lasting / objects)
        assert scores.idp == pytest.approx(lasting / predictions)


def test_perfect():
    truth = line({"a": 0.0, "b": 50.0}, {"a": 1.0, "b": 51.0})
    scores = identity_scores(truth, line({7: 0.0, 8: 50.0}, {7: 1.0, 8: 51.0}))
    assert [getattr(scores, name) for name in NAMES] == [0, 0, 0, 0]
    assert [getattr(scores, share) for share in SHARES] == [1.0, 0.0, 1.0, 1.0, 1.0]


def test_two_identities_exchanged():
    truth = line(*[{"a": 0.0, "b": 50.0}] * 4)
    tracks = line(*[{1: 0.0, 2: 50.0}] * 3, {1: 50.0, 2: 0.0})
    scores = identity_scores(truth, tracks)
    assert scores.switches == 2
    assert scores.mota == 1.0 - 2 / 8
    assert scores.idf1 == 6 / 8


def test_lost_and_found_is_a_fragmentation_and_no_switch():
    truth = line(*[{"a": 0.0}] * 6)
    tracks = line({1: 1.0}, {}, {}, {1: 2.0}, {1: 11.0}, {})
    scores = identity_scores(truth, tracks)
    assert (scores.switches, scores.fragmentations) == (0, 1)
    # The instant out of the gate is a miss and a false positive; the last gap never ends.
    assert (scores.misses, scores.false_positives) == (4, 1)
    assert scores.motp == 1.5
    assert scores.mota == 1.0 - 5 / 6
    assert (scores.idr, scores.idp) == (2 / 6, 2 / 3)


def test_a_target_that_left_is_not_missed():
    scores = identity_scores(line({"a": 0.0}, {}, {"a": 0.0}), line({1: 0.0}, {}, {1: 0.0}))
    assert (scores.misses, scores.fragmentations, scores.mota) == (0, 0, 1.0)


def test_kept_while_near_though_another_is_nearer():
    truth = line({"a": 0.0}, {"a": 0.0})
    scores = identity_scores(truth, line({1: 1.0}, {1: 9.0, 2: 0.0}))
    assert (scores.switches, scores.false_positives) == (0, 1)
    assert scores.motp == 5.0


def test_nothing_is_undefined():
    empty = identity_scores([], [])
    assert {getattr(empty, share) for share in SHARES} == {None}
    only_false = identity_scores(line({}), line({1: 0.0}))
    assert (only_false.mota, only_false.idp, only_false.idr) == (None, 0.0, None)
    only_missed = identity_scores(line({"a": 0.0}), line({}))
    assert (only_missed.mota, only_missed.motp, only_missed.idr) == (0.0, None, 0.0)


@pytest.mark.parametrize(
    ("truth", "tracks", "gate", "word"),
    [
        (line({1: 0.0}), [], 10.0, "tracks has 0 instants"),
        ([([1], [])], line({}), 10.0, r"truth\[0\] has 1 ids"),
        (line({}), [([1, 1], [[0.0, 0.0]] * 2)], 10.0, r"tracks\[0\] ids = \[1, 1\]"),
        (line({}), line({1: math.nan}), 10.0, r"tracks\[0\] positions = .*finite"),
        (line({}), line({}), 0.0, "gate = 0.0"),
    ],
)
def test_refuses_what_it_cannot_use(truth, tracks, gate, word):
    with pytest.raises(ValueError, match=word):
        identity_scores(truth, tracks, gate=gate)
