"""Which sighting is whose: particles by SciPy, shares by enumeration, rules by brute force."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import multivariate_normal

from staniel.kernels.association import contested, marginals, rescore, settled
from staniel.tracking.assignment import FREE, assign

CLUTTER, HIT = math.log(1e-4), 9.0
RULES = ("nearest", "likeliest", "soft")


@st.composite
def problems(draw, tracks=4, sightings=6, looks=3):
    """Pairs in ascending order of the track, scores about the clutter's, looks."""
    m = draw(st.integers(1, sightings))
    both = [(k, j) for k in range(draw(st.integers(1, tracks))) for j in range(m)]
    chosen = draw(st.lists(st.sampled_from(both), unique=True, min_size=1))
    pairs = np.array(sorted(chosen), np.int64).reshape(-1, 2)
    g = np.random.default_rng(draw(st.integers(0, 10_000)))
    return (
        pairs,
        CLUTTER + g.uniform(-2.0, 8.0, len(pairs)),
        np.array([draw(st.integers(0, looks - 1)) for _ in range(m)], np.int64),
    )


def rivals_of(p, pairs, looks):
    k, j = pairs[p]
    return [
        q
        for q, (a, b) in enumerate(pairs)
        if q != p and (b == j or (a == k and looks[b] == looks[j]))
    ]


def owned(rule, pairs, scores, looks):
    return assign(rule, pairs, scores, looks, CLUTTER, HIT)


@given(problems(sightings=8))
@settings(max_examples=200, deadline=None)
def test_contested_is_who_has_a_rival(problem):
    pairs, _, looks = problem
    expected = [bool(rivals_of(p, pairs, looks)) for p in range(len(pairs))]
    assert contested(pairs, looks).tolist() == expected


# ---------------------------------------------------------------- particles


@pytest.mark.parametrize("width", [0.0, 0.3, 0.9])
@pytest.mark.parametrize("age", [0.0, 2.0])
def test_scores_are_the_summed_gaussian_likelihood(width, age):
    g = np.random.default_rng(0)
    n, now = 1000, 10.0
    state = g.normal(0.0, 3.0, (2, 4, n)).astype(np.float32)
    raw = g.random((2, n))
    weights = (raw / raw.sum(axis=1, keepdims=True)).astype(np.float32)
    origins = np.array([[100.0, 0.0], [1e6, -1e6]])
    covariances = np.array([np.cov(s.astype(float)) for s in state])
    sigma = np.array([[2.0, 0.7], [0.7, 1.0]])
    z = np.array([[now - age, *(origins[k] + [1.0, -2.0]), 2.0, 0.7, 1.0] for k in (0, 1)])
    pairs, scores = np.array([[0, 0], [0, 1], [1, 1]]), np.full(3, 7.0)
    chosen = np.array([True, False, True])
    rescore(pairs, scores, chosen, state, weights, origins, covariances, z, now, width)
    assert scores[1] == 7.0
    for p in (0, 2):
        k = pairs[p, 0]
        P = covariances[k, :2, :2]
        S = sigma + min(width**2, np.trace(sigma) / np.trace(P)) * P
        assert np.trace(S) < 2.001 * np.trace(sigma)
        places = state[k, :2].astype(float) - age * state[k, 2:]
        density = multivariate_normal([1.0, -2.0], S).pdf(places.T)
        assert scores[p] == pytest.approx(math.log(weights[k] @ density), abs=2e-4)


# ---------------------------------------------------------------- shares


def by_enumeration(pairs, gains, looks):
    """Probability of each pair, over all ways to give each track and look at most one sighting."""
    beliefs = np.zeros(len(pairs))
    for look in np.unique(looks):
        mine = [p for p in range(len(pairs)) if looks[pairs[p, 1]] == look]
        total = 0.0
        for size in range(len(mine) + 1):
            for chosen in itertools.combinations(mine, size):
                own = pairs[list(chosen)]
                if len({*own[:, 0]}) < size or len({*own[:, 1]}) < size:
                    continue
                weight = math.prod(gains[list(chosen)])
                total += weight
                beliefs[list(chosen)] += weight
        beliefs[mine] /= total
    return beliefs


def beliefs_of(pairs, gains, looks, rounds=300):
    """What a track makes of its shares."""
    weight = marginals(pairs, gains, looks, rounds) * gains
    row = pairs[:, 0] * (looks.max() + 1) + looks[pairs[:, 1]]
    return weight / (1.0 + np.bincount(row, weight)[row])


def without_loops(pairs, looks):
    """Pairs that leave a forest in every look, the first ones kept."""
    root = {}

    def find(node):
        while node in root:
            node = root[node]
        return node

    kept = []
    for p, (k, j) in enumerate(pairs.tolist()):
        a, b = find(("track", k, int(looks[j]))), find(("sighting", j))
        if a != b:
            root[a] = b
            kept.append(p)
    return kept


@given(problems(sightings=5, looks=2))
@settings(max_examples=100, deadline=None)
def test_shares_are_exact_without_loops(problem):
    pairs, scores, looks = problem
    kept = without_loops(pairs, looks)
    pairs, gains = pairs[kept], HIT * np.exp(scores[kept] - CLUTTER)
    np.testing.assert_allclose(
        beliefs_of(pairs, gains, looks), by_enumeration(pairs, gains, looks), atol=1e-5
    )


def test_shares_are_nearly_exact_with_loops():
    """All pairs of three tracks and three sightings, none of them nearly certain."""
    pairs = np.array(list(itertools.product(range(3), range(3))))
    looks = np.zeros(3, np.int64)
    errors = []
    for seed in range(200):
        gains = np.exp(np.random.default_rng(seed).uniform(-3.0, 2.0, 9))
        errors.append(beliefs_of(pairs, gains, looks, 30) - by_enumeration(pairs, gains, looks))
    assert np.abs(errors).max() < 0.07
    assert np.abs(errors).mean() < 0.008


@pytest.mark.parametrize("ratio", [1.2, 2.0, 20.0])
def test_shares_of_two_sure_rivals_are_too_sure_but_on_the_right_side(ratio):
    """Known of belief propagation: with hardly a miss it finds the best assignment instead."""
    pairs = np.array([[0, 0], [0, 1], [1, 0], [1, 1]])
    gains, looks = np.array([ratio, 1.0, 1.0, 1.0]) * 1e5, np.zeros(2, np.int64)
    exact, ours = by_enumeration(pairs, gains, looks), beliefs_of(pairs, gains, looks, 30)
    assert (np.abs(ours - 0.5) > np.abs(exact - 0.5)).all()
    np.testing.assert_array_equal(ours > 0.5, exact > 0.5)


def test_two_even_rivals_share_two_sightings_evenly():
    pairs = np.array([[0, 0], [0, 1], [1, 0], [1, 1]])
    beliefs = beliefs_of(pairs, np.full(4, 1e6), np.zeros(2, np.int64))
    np.testing.assert_allclose(beliefs, 0.5, atol=1e-3)


def test_a_pair_without_rival_has_all_of_its_share():
    assert marginals(np.array([[0, 0]]), np.array([5.0]), np.zeros(1, np.int64), 30).tolist() == [1]


# ---------------------------------------------------------------- rules


def all_assignments(pairs):
    """Every way to give each track and each sighting at most one partner."""
    for size in range(min(pairs[:, 0].max(), pairs[:, 1].max()) + 2):
        for chosen in itertools.combinations(range(len(pairs)), size):
            own = pairs[list(chosen)]
            if len({*own[:, 0]}) == len({*own[:, 1]}) == size:
                yield list(chosen)


@given(problems(tracks=3, sightings=5, looks=2))
@settings(max_examples=100, deadline=None)
def test_nearest_is_the_best_sum_of_all_assignments_of_each_look(problem):
    pairs, scores, looks = problem
    owners, shares = owned("nearest", pairs, scores, looks)
    taken = np.flatnonzero(shares)
    for look in np.unique(looks):
        mine = np.flatnonzero((looks[pairs[:, 1]] == look) & (scores > CLUTTER))
        if not mine.size:
            continue
        best = max(sum(scores[mine[c]] - CLUTTER) for c in all_assignments(pairs[mine]))
        ours = [p for p in taken if looks[pairs[p, 1]] == look]
        assert sum(scores[ours] - CLUTTER) == pytest.approx(best, abs=1e-9)
    assert (scores[taken] > CLUTTER).all()
    np.testing.assert_array_equal(owners[pairs[taken, 1]], pairs[taken, 0])
    assert (owners >= 0).sum() == taken.size


def greedily(pairs, scores, looks):
    """The greatest score of the whole table, again and again."""
    left = {p: scores[p] for p in range(len(pairs)) if scores[p] > CLUTTER}
    owner = np.full(len(looks), FREE)
    while left:
        p = max(left, key=left.get)
        k, j = pairs[p]
        owner[j] = k
        for q in [p, *rivals_of(p, pairs, looks)]:
            left.pop(q, None)
    return owner


@given(problems(sightings=8))
@settings(max_examples=200, deadline=None)
def test_likeliest_is_a_greedy_search(problem):
    owners, shares = owned("likeliest", *problem)
    np.testing.assert_array_equal(owners, greedily(*problem))
    pairs = problem[0]
    np.testing.assert_array_equal(shares, owners[pairs[:, 1]] == pairs[:, 0])


@given(problems(sightings=5, looks=2))
@settings(max_examples=100, deadline=None)
def test_soft_gives_to_whom_the_sighting_is_by_more_than_half(problem):
    pairs, scores, looks = problem
    kept = without_loops(pairs, looks)
    pairs, scores = pairs[kept], scores[kept]
    owners, shares = owned("soft", pairs, scores, looks)
    gains = HIT * np.exp(scores - CLUTTER)
    exact = by_enumeration(pairs, gains, looks)
    for p, (k, j) in enumerate(pairs.tolist()):
        if abs(exact[p] - 0.5) > 1e-3:
            assert (owners[j] == k) == (exact[p] > 0.5)
        assert 0.0 <= shares[p] <= 1.0
        if exact[p] > 2e-3:
            assert shares[p] > 0.0
        if exact[p] < 5e-4:
            assert shares[p] == 0.0


@given(problems(sightings=8), st.sampled_from(RULES))
@settings(max_examples=300, deadline=None)
def test_every_rule_gives_a_sighting_one_owner_and_a_track_one_sighting_of_a_look(problem, rule):
    pairs, _, looks = problem
    owners, shares = owned(rule, *problem)
    inside = set(map(tuple, pairs.tolist()))
    given_ = [(int(k), int(looks[j])) for j, k in enumerate(owners) if k != FREE]
    assert len(set(given_)) == len(given_)
    assert all((int(k), j) in inside for j, k in enumerate(owners) if k != FREE)
    assert shares.shape == (len(pairs),)
    if rule != "soft":
        assert set(shares) <= {0.0, 1.0}
        assert shares.sum() == (owners != FREE).sum()


@pytest.mark.parametrize("rule", RULES)
def test_nothing_to_decide(rule):
    none = np.zeros((0, 2), np.int64), np.zeros(0)
    for looks in (np.zeros(0, np.int64), np.array([0, 0, 1])):
        owners, shares = owned(rule, *none, looks)
        assert owners.tolist() == [FREE] * len(looks)
        assert shares.shape == (0,)


@pytest.mark.parametrize("rule", RULES)
def test_greatest_scores_do_not_overflow(rule):
    pairs = np.array([[0, 0], [0, 1], [1, 0], [1, 1]])
    scores = np.array([2000.0, -2000.0, -2000.0, 2000.0])
    owners, shares = owned(rule, pairs, scores, np.zeros(2, np.int64))
    assert owners.tolist() == [0, 1]
    assert np.isfinite(shares).all()


@given(problems(tracks=5, sightings=6, looks=2))
@settings(max_examples=200, deadline=None)
def test_plain_knots_are_settled_and_all_others_left(problem):
    pairs, scores, looks = problem
    owners, shares, tangled = settled(pairs, scores, looks, CLUTTER)
    worth = [p for p in range(len(pairs)) if scores[p] > CLUTTER]
    rivals = {p: [q for q in rivals_of(p, pairs, looks) if q in worth] for p in worth}
    for p in worth:
        knot, edge = {p}, [p]
        while edge:
            new = set(rivals[edge.pop()]) - knot
            knot |= new
            edge += new
        one_end = len({pairs[q, 0] for q in knot}) == 1 or len({pairs[q, 1] for q in knot}) == 1
        assert (p in tangled) == (not one_end)
        if one_end:
            best = max(knot, key=lambda q: scores[q])
            assert shares[p] == (p == best)
            assert owners[pairs[best, 1]] == pairs[best, 0]
    assert shares.sum() == (owners >= 0).sum()
    assert not shares[tangled].any()
