# Random draws: numbers, not only laws. Expected values come from numpy (tests/tools/snippets.sh checks them).
import numpy as np

rng = np.random.default_rng(42)
assert rng.random() == 0.7739560485559633 and rng.uniform(-1, 1) == -0.12224312049589536
assert rng.integers(0, 10, 5).tolist() == [4, 8, 0, 6, 2]
assert rng.standard_normal(2).tolist() == [-1.302179506862318, 0.12784040316728537]
assert rng.permutation(6).tolist() == [1, 4, 2, 3, 0, 5]
assert rng.choice(20, 5, replace=False).tolist() == [7, 18, 8, 6, 3]
assert rng.choice([1.0, 2.0, 3.0], 4, p=[0.2, 0.3, 0.5]).tolist() == [2.0, 2.0, 3.0, 1.0]
v = np.arange(5)
rng.shuffle(v)
assert v.tolist() == [2, 1, 3, 4, 0]
assert rng.integers(3, 5, endpoint=True, size=(2, 2)).tolist() == [[5, 5], [4, 3]]
big = np.random.default_rng(2**40 + 7)
assert big.random() == 0.829812891829413
np.random.seed(7)
assert np.random.rand() == 0.07630828937395717 and np.random.uniform(0, 2, 2).tolist() == [1.5598375844802292, 0.876818462881787]
assert np.random.randn(3).tolist() == [0.09316606097975175, 3.200914709117712, -0.1569886595634109] and np.random.randint(0, 100, 4).tolist() == [39, 68, 48, 7]
assert np.random.permutation(5).tolist() == [1, 3, 2, 0, 4] and np.random.choice(9, 3, replace=False).tolist() == [2, 8, 1]
state = np.random.RandomState(3)
assert state.random_sample((2,)).tolist() == [0.5507979025745755, 0.7081478226181048] and state.exponential(2.0) == 0.6875308033823906
assert state.normal(1.0, 2.0) == 2.9611077405817663 and state.choice(4, 3).tolist() == [2, 3, 1]
# a hundred thousand normals cover the wedges and the tail of the ziggurat
many = np.random.default_rng(5).normal(size=100000)
assert many.max() == 4.358604979783261 and many.min() == -4.363180576133111 and abs(many.mean() - 0.000910627954924058) < 1e-15
