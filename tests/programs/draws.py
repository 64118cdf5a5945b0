#%% legacy uniform streams
import numpy as np
np.random.seed(123)
out = np.concatenate([np.random.rand(3), np.random.random(2), np.random.random_sample(2), np.random.uniform(-1, 1, size=(2, 2)).ravel(), np.random.uniform([0, 10], [1, 20]), np.random.sample(1), [np.random.uniform()]])
#%% legacy normal streams
import numpy as np
np.random.seed(7)
out = np.concatenate([np.random.randn(3), np.random.normal(1, 2, 4), np.random.standard_normal((1, 2)).ravel(), [np.random.randn()], np.random.normal(loc=[0, 5], scale=0.1)])
#%% legacy integers and choices
import numpy as np
np.random.seed(11)
a = np.arange(6)
np.random.shuffle(a)
out = np.concatenate([np.random.randint(0, 10, 5), np.random.randint(5, size=(2, 2)).ravel(), a, np.random.permutation(5), np.random.choice(10, 4), np.random.choice(10, 4, replace=False), np.random.choice([0.5, 1.5], 3, p=[0.3, 0.7]), np.random.permutation([[1, 2], [3, 4], [5, 6]]).ravel()])
#%% generator uniform streams
import numpy as np
rng = np.random.default_rng(123)
out = np.concatenate([rng.random(3), rng.uniform(-1, 1, (2, 2)).ravel(), rng.uniform(low=0, high=[1, 10], size=(2, 2)).ravel(), [rng.random(), rng.uniform(2, 3)], rng.random((2, 1)).ravel(), rng.random(size=2, dtype=np.float64)])
#%% generator normal and exponential streams
import numpy as np
rng = np.random.default_rng(seed=99)
out = np.concatenate([rng.normal(size=5), rng.standard_normal((2, 2)).ravel(), rng.normal(3.0, 0.5, 2), rng.lognormal(0, 1, 2), rng.exponential(2.0, 2) * 0, rng.standard_exponential(2) * 0])
#%% generator integers, choice, permutation, shuffle
import numpy as np
rng = np.random.default_rng(2024)
a = np.arange(5)
rng.shuffle(a)
out = np.concatenate([rng.integers(0, 10, 6), rng.integers(3, size=2), rng.integers(1, 6, size=4, endpoint=True), rng.permutation(6), a, rng.choice(5, 3), rng.choice(10, 5, replace=False), rng.choice([1.5, 2.5, 3.5], size=3), rng.choice(4, 3, p=[0.1, 0.2, 0.3, 0.4])])
#%% seeds of every size
import numpy as np
out = np.array([np.random.default_rng(s).random() for s in (0, 1, 2**31, 2**32, 2**40, 12345678901234567)] + [np.random.RandomState(s).rand() for s in (0, 1, 2**32 - 1)] + [np.random.Generator(np.random.PCG64(5)).random()])
#%% triangular, beta and the like through uniforms
import numpy as np
rng = np.random.default_rng(8)
u = rng.uniform(size=(4, 3))
tri = 1 - np.abs(u[:, 0] - u[:, 1])
out = np.concatenate([tri, rng.triangular(0, 1, 2, 3), rng.random(2)])
#%% two generators side by side
import numpy as np
r1, r2 = np.random.default_rng(1), np.random.default_rng(1)
np.random.seed(1)
x = [r1.random(), np.random.rand(), r2.random(), r1.normal(), r2.normal()]
out = np.array(x)
#%% spawn a seed from draws
import numpy as np
base = np.random.RandomState(0)
seeds = base.randint(0, 2**31 - 1, size=3)
out = np.concatenate([seeds, [np.random.RandomState(s).uniform() for s in seeds]])
#%% choice of rows and axis
import numpy as np
rng = np.random.default_rng(4)
pts = np.arange(12.0).reshape(4, 3)
out = np.concatenate([rng.choice(pts, 2, replace=False).ravel(), rng.choice(pts, 2, axis=1, replace=False).ravel()])
#%% state and get back
import numpy as np
np.random.seed(5)
a = np.random.rand(2)
np.random.seed(5)
b = np.random.rand(2)
np.random.seed(seed=6)
out = np.concatenate([a, b, np.random.rand(1), np.random.exponential(size=2)])
#%% seeds of several words
import numpy as np
out = np.concatenate([np.random.default_rng([1, 2, 3]).random(3), np.random.default_rng((7, 2**40)).random(2), np.random.default_rng(np.array([5, 6, 7, 8, 9])).random(2)])
