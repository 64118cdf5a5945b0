# numpy: every assertion holds with numpy too (tests/tools/snippets.sh runs it there).
import numpy as np
from numpy import linspace

eq = np.array_equal
a = np.arange(12).reshape(3, 4)

# views, slices, masks, index arrays
assert eq(a[1], [4, 5, 6, 7]) and a[1, 2] == 6 and a[-1, -1] == 11 and eq(a[:, 1], [1, 5, 9])
assert eq(a[::-1, ::2], [[8, 10], [4, 6], [0, 2]]) and a[..., 0].shape == (3,) and a[:, None, :].shape == (3, 1, 4)
assert a[np.newaxis].shape == (1, 3, 4) and a.T.shape == (4, 3) and eq(a[a % 2 == 0], [0, 2, 4, 6, 8, 10])
assert eq(a[[0, 2]], a[::2]) and eq(a[[0, 1], [1, 2]], [1, 6]) and eq(a[:, [3, 0]], [[3, 0], [7, 4], [11, 8]])
assert eq(a[np.array([True, False, True])], a[::2]) and a[a > 100].shape == (0,) and a[1:1].shape == (0, 4)
assert eq(a[np.ix_([0, 2], [1])], [[1], [9]]) and isinstance(a, np.ndarray)
b = a.copy()
column = b[:, 1]
column += 100
assert b[0, 1] == 101 and a[0, 1] == 1
b[b > 100] = 0
b[0] = -1
b[1, ::2] = [7, 8]
b[2] *= 2
assert eq(b, [[-1, -1, -1, -1], [7, 0, 8, 7], [16, 0, 20, 22]])
c = np.zeros((2, 3, 4))
c[0, :, 1] = 5
c[:, [0, 2], 3] = np.arange(4).reshape(2, 2)
assert c.sum() == 15 + 6 and c[1, 2, 3] == 3 and c[:, 0, [1, 2]].shape == (2, 2) and c[0, :, [1, 2]].shape == (2, 3)
v = np.arange(5)
v[1:] = v[:-1]
assert eq(v, [0, 0, 1, 2, 3])
p = np.zeros((4, 3))
p[:, 1] -= 0.5
assert p[0, 1] == -0.5 and p.mean(axis=0)[1] == -0.5

# types
assert (a / 2).dtype == np.float64 and (a // 2).dtype == np.int64 and (a > 1).dtype == bool and (a + 1.5).dtype == float
assert np.array([1, 2.5]).dtype == np.float64 and np.zeros(2, dtype=int).dtype == int and a.astype(float).dtype == float
assert eq(np.array([1.7, -1.7]).astype(int), [1, -1]) and np.float64(3) == 3.0 and int(np.array([5])[0]) == 5
assert (np.ones(2, dtype=np.float32) * 2.0).dtype == np.float32
assert (True + np.array([1, 2])).sum() == 5 and (np.array([True, True]) & np.array([True, False])).sum() == 1

# arithmetic and broadcasting
assert eq(np.arange(3)[:, None] * np.arange(2), [[0, 0], [0, 1], [0, 2]]) and eq(-a + a, np.zeros((3, 4)))
assert eq(np.array([7, -7]) // 2, [3, -4]) and eq(np.array([7, -7]) % 3, [1, 2]) and eq(2 ** np.arange(4), [1, 2, 4, 8])
assert np.allclose(np.array([4.0, 9.0]) ** 0.5, [2, 3]) and eq(~np.array([True, False]), [False, True])
assert eq([1, 2] + np.array([1, 1]), [2, 3]) and (np.array([1.0, 2.0]) @ np.array([3.0, 4.0])) == 11.0
assert np.isinf(np.array([1.0]) / np.array([0.0])).all() and np.isnan(np.array([0.0]) / 0).all()
assert eq(np.maximum([1, 5], [3, 2]), [3, 5]) and eq(np.clip([1, 5, 9], 2, 6), [2, 5, 6]) and eq(np.minimum(3, [1, 4]), [1, 3])

# creation
assert eq(np.linspace(0, 1, 5), [0, 0.25, 0.5, 0.75, 1]) and linspace(0, 1, 4, endpoint=False)[-1] == 0.75
assert eq(np.arange(0, 1, 0.25), [0, 0.25, 0.5, 0.75]) and eq(np.arange(5, 0, -2), [5, 3, 1]) and np.full((2, 2), 7).sum() == 28
assert eq(np.eye(2), [[1, 0], [0, 1]]) and np.ones_like(a).dtype == a.dtype and eq(np.diag([1, 2]), [[1, 0], [0, 2]])
X, Y = np.meshgrid(np.arange(3), np.arange(2))
assert X.shape == (2, 3) and Y[1, 0] == 1
X, Y, Z = np.meshgrid([0, 1], [0, 1, 2], [0, 1, 2, 3], indexing="ij")
assert X.shape == (2, 3, 4) and eq(np.stack([X, Y, Z], axis=-1).reshape(-1, 3)[5], [0, 1, 1])
assert np.mgrid[0:2, 0:3].shape == (2, 2, 3) and eq(np.mgrid[0:1:3j], [0, 0.5, 1]) and np.indices((2, 3))[1, 0, 2] == 2
assert eq(np.c_[[1, 2], [3, 4]], [[1, 3], [2, 4]]) and eq(np.r_[1, [2, 3], 4:6], [1, 2, 3, 4, 5])

# shapes and joining
assert a.ravel().shape == (12,) and a.reshape(2, -1).shape == (2, 6) and a.flatten()[5] == 5 and a.transpose(1, 0).shape == (4, 3)
assert np.vstack([a, a]).shape == (6, 4) and np.hstack([a, a]).shape == (3, 8) and np.vstack([[1, 2], [3, 4]]).shape == (2, 2)
assert np.column_stack([np.arange(3), np.ones(3)]).shape == (3, 2) and np.concatenate([a, a], axis=1).shape == (3, 8)
assert eq(np.tile([1, 2], 2), [1, 2, 1, 2]) and np.tile([[1, 2]], (3, 1)).shape == (3, 2) and eq(np.repeat([1, 2], 2), [1, 1, 2, 2])
assert eq(np.repeat([[1, 2]], 2, axis=0), [[1, 2], [1, 2]]) and np.stack([[1, 2], [3, 4]], axis=1)[0, 1] == 3
assert np.squeeze(np.ones((1, 3, 1))).shape == (3,) and np.expand_dims([1, 2], 1).shape == (2, 1) and eq(np.roll([1, 2, 3], 1), [3, 1, 2])
assert eq(np.flip([1, 2, 3]), [3, 2, 1]) and [len(s) for s in np.array_split(np.arange(7), 3)] == [3, 2, 2]
assert eq(np.append([1], [2, 3]), [1, 2, 3]) and eq(np.delete([1, 2, 3], 1), [1, 3]) and eq(np.insert([1, 3], 1, 2), [1, 2, 3])
assert a.reshape(4, 3, order="F")[1, 0] == 4

# reductions
assert a.sum() == 66 and eq(a.sum(axis=0), [12, 15, 18, 21]) and a.mean(axis=1, keepdims=True).shape == (3, 1)
assert a.min() == 0 and a.max(axis=0)[3] == 11 and a.argmax() == 11 and eq(np.argmin(a, axis=1), [0, 0, 0])
assert np.isclose(np.std([1, 2, 3, 4]), 1.118033988749895) and np.var([1, 2, 3], ddof=1) == 1.0 and np.median([3, 1, 2]) == 2
assert np.any(a > 10) and not np.all(a > 10) and eq(np.cumsum([1, 2, 3]), [1, 3, 6]) and np.prod([2, 3, 4]) == 24
assert np.percentile([1, 2, 3, 4], 50) == 2.5 and eq(np.diff([1, 4, 9]), [3, 5]) and np.ptp([3, 9]) == 6 and a.sum(axis=(0, 1)) == 66
assert np.average([1, 3], weights=[3, 1]) == 1.5 and np.count_nonzero(a > 5) == 6 and eq(a.cumsum(axis=0)[2], [12, 15, 18, 21])

# choosing, sorting, searching
assert eq(np.where(a > 5, 1, 0).sum(axis=1), [0, 2, 4]) and eq(np.where([False, True, True])[0], [1, 2])
assert eq(np.sort([3, 1, 2]), [1, 2, 3]) and eq(np.argsort([3, 1, 2]), [1, 2, 0]) and eq(np.unique([2, 1, 2]), [1, 2])
u, counts = np.unique([2, 1, 2], return_counts=True)
assert eq(counts, [1, 2]) and eq(np.searchsorted([1, 2, 3], [0, 2, 5]), [0, 1, 3]) and eq(np.isin([1, 2], [2]), [False, True])
assert eq(np.nonzero([0, 3])[0], [1]) and eq(np.argwhere(np.eye(2)), [[0, 0], [1, 1]]) and np.interp(0.5, [0, 1], [0, 10]) == 5
assert eq(np.bincount([0, 2, 2]), [1, 0, 2]) and eq(np.digitize([0.5, 1.5], [0, 1, 2]), [1, 2]) and eq(np.sort(a, axis=0), a)
assert eq(np.round([1.25, 2.35], 1), [1.2, 2.4]) and eq(np.floor([-0.5, 1.5]), [-1, 1]) and eq(np.sign([-2, 0, 2]), [-1, 0, 1])

# linear algebra
m = np.array([[2.0, 1.0], [1.0, 3.0]])
assert np.isclose(np.linalg.det(m), 5) and np.allclose(np.linalg.inv(m) @ m, np.eye(2)) and np.allclose(np.linalg.solve(m, [3, 4]), [1, 1])
assert np.linalg.norm([3, 4]) == 5 and eq(np.linalg.norm([[3, 4], [6, 8]], axis=1), [5, 10]) and np.linalg.norm(m, axis=1, keepdims=True).shape == (2, 1)
assert eq(np.cross([1, 0, 0], [0, 1, 0]), [0, 0, 1]) and np.dot([1, 2], [3, 4]) == 11 and eq(np.outer([1, 2], [3, 4]), [[3, 4], [6, 8]])
assert np.allclose(np.einsum("ij,kj->ik", m, m), m @ m.T)
assert np.allclose(np.einsum("ij,j", m, [1.0, 1.0]), [3, 4]) and np.trace(m) == 5 and np.vdot(m, m) == 15
assert (np.ones((5, 3)) @ np.ones((3, 2))).shape == (5, 2) and (np.ones((4, 2, 3)) @ np.ones((3,))).shape == (4, 2)
t = np.pi / 4
rotation = np.array([[np.cos(t), 0, np.sin(t)], [0, 1, 0], [-np.sin(t), 0, np.cos(t)]])
assert np.allclose((np.array([[1.0, 0, 0]]) @ rotation.T)[0], [2 ** -0.5, 0, -(2 ** -0.5)]) and np.isclose(np.deg2rad(180), np.pi)

# lists of points, loops over rows
points = []
for x, z in zip(np.linspace(0, 1, 3), range(3)):
    points.append([x, 0.0, z])
points = np.array(points)
assert points.shape == (3, 3) and [float(row[0]) for row in points] == [0.0, 0.5, 1.0] and len(points) == 3
assert np.vectorize(lambda v: v * 2)(np.arange(3)).tolist() == [0, 2, 4] and points.tolist()[1] == [0.5, 0.0, 1.0]
pieces = {f"piece{i}": points + np.array([i, 0, 0]) for i in range(2)}
piece0, piece1 = pieces.values()
assert piece1[0, 0] == 1.0

# what models write
theta, phi = np.meshgrid(np.linspace(0, 2 * np.pi, 8, endpoint=False), np.linspace(0, np.pi, 5))
sphere = np.stack([np.sin(phi) * np.cos(theta), np.cos(phi), np.sin(phi) * np.sin(theta)], axis=-1).reshape(-1, 3)
assert sphere.shape == (40, 3) and np.allclose(np.linalg.norm(sphere, axis=1), 1)
grid = np.array([[x, y, z] for x in np.arange(-1, 1.01, 0.5) for y in (0, 1) for z in range(2)])
inside = grid[np.linalg.norm(grid, axis=1) <= 1.0]
assert grid.shape == (20, 3) and inside.shape == (7, 3) and (inside ** 2).sum(axis=1).max() <= 1.0
x, y, z = grid.T
assert eq(x, grid[:, 0]) and len(z) == 20
lower, upper = grid.min(axis=0), grid.max(axis=0)
assert eq(upper - lower, [2, 1, 1]) and ((grid >= lower) & (grid <= upper)).all()
half = grid[(grid[:, 0] < 0) & ~(grid[:, 1] > 0.5)]
half[:, 0] += -0.5
assert half.shape == (4, 3) and half[:, 0].max() == -1.0 and grid[0, 0] == -1.0
angles = np.arange(6) * (2 * np.pi / 6)
ring = np.column_stack((np.cos(angles), np.zeros_like(angles), np.sin(angles)))
assert np.allclose(ring.mean(axis=0), 0) and np.vstack((ring, -ring))[6:].shape == (6, 3)
rows = []
while len(rows) < 5:
    q = [len(rows), 0, 1]
    if q[0] % 2 == 0 or len(rows) > 0:
        rows.append(q)
assert np.asarray(rows, dtype=float).shape == (5, 3) and np.array(rows)[:, 0].tolist() == [0, 1, 2, 3, 4]
r2 = np.sqrt(np.sum(np.square(ring[:, [0, 2]]), axis=1, keepdims=True))
assert r2.shape == (6, 1) and np.allclose(ring / r2, ring) and np.isclose(np.hypot(*ring[1, [0, 2]]), 1.0)
k = np.arange(4)[:, None]
assert ((0.5 + k * np.array([0.8, 0.6, 0.5])) % 1.0).shape == (4, 3) and (k / 4).max() == 0.75 and k.shape[0] == 4
counts = np.zeros(3, dtype=int)
for i in [0, 2, 2]:
    counts[i] += 1
assert counts.tolist() == [1, 0, 2] and np.repeat(np.eye(3)[None], 2, axis=0).shape == (2, 3, 3)
assert np.where(ring[:, 0] > 0, ring[:, 0], -ring[:, 0]).min() > 0.49 and float(ring[0, 0]) == 1.0 and ring[0].tolist()[1] == 0.0
