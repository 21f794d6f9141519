import numpy as np
import pytest

from logpose.pipelines.estimation.resampling import roulette, systematic


@pytest.mark.parametrize("seed", range(20))
def test_systematic_draws_each_particle_floor_or_ceil_times(seed):
    rng = np.random.default_rng(seed)
    w = rng.dirichlet(np.ones(50))
    counts = np.bincount(systematic(w, rng), minlength=50)
    assert np.all(counts >= np.floor(50 * w - 1e-9))
    assert np.all(counts <= np.ceil(50 * w + 1e-9))


def test_roulette_draws_in_proportion():
    rng = np.random.default_rng(1)
    w = np.array([0.5, 0.3, 0.2, 0.0])
    counts = sum(np.bincount(roulette(w, rng), minlength=4) for _ in range(20000))
    share = counts / counts.sum()
    # 5 sigma of 80 000 draws is 0.009
    assert share == pytest.approx(w, abs=0.009)
    assert counts[3] == 0


@pytest.mark.parametrize("draw", [systematic, roulette])
def test_one_particle_and_one_weight(draw):
    rng = np.random.default_rng(0)
    assert draw(np.array([1.0]), rng).tolist() == [0]
    assert set(draw(np.array([0.0, 0.0, 1.0]), rng).tolist()) == {2}


def test_rounding_of_the_sum_never_leaves_the_cloud():
    rng = np.random.default_rng(0)
    for _ in range(200):
        w = np.full(3, 1.0 / 3.0) * (1 - 1e-12)
        assert systematic(w, rng).max() <= 2
