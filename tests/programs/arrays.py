#%% creation
import numpy as np
out = np.concatenate([np.zeros(2), np.ones((1, 2)).ravel(), np.full(2, 7.5), np.arange(2, 10, 3), np.arange(0, 1, 0.25), np.linspace(0, 1, 4, endpoint=False), np.eye(2).flatten(), np.identity(2).ravel(), np.logspace(0, 2, 3), np.geomspace(1, 8, 4), np.empty(0), np.zeros_like([1, 2]), np.full_like(np.ones(2), 3), np.tri(2).ravel(), np.fromiter((i**2 for i in range(3)), dtype=float), np.array([[1, 2], [3, 4]], dtype=np.float32).ravel()])
#%% shaping
import numpy as np
a = np.arange(24).reshape(2, 3, 4)
out = np.concatenate([a.T.ravel()[:6], a.transpose(1, 0, 2).reshape(-1)[:6], np.swapaxes(a, 0, 2).shape, np.moveaxis(a, -1, 0).shape, a.reshape(4, -1)[1], np.squeeze(a[:1]).shape, np.expand_dims(a, 1).shape, np.ravel(a, order="F")[:5], np.atleast_2d([1, 2]).shape, a.swapaxes(0, 1)[2, 1], np.flip(a, axis=2)[0, 0], np.flipud(a)[0, 0], np.fliplr(a)[0, 0], np.rot90(np.eye(2, 3)).ravel(), np.roll(np.arange(5), 2)])
#%% joining and splitting
import numpy as np
a, b = np.arange(6).reshape(2, 3), np.arange(6, 12).reshape(2, 3)
x, y, z = np.split(np.arange(9), 3)
p, q = np.array_split(np.arange(5), 2)
l, r = np.hsplit(np.arange(8).reshape(2, 4), 2)
out = np.concatenate([np.vstack([a, b]).ravel(), np.hstack([a, b])[1], np.dstack([a, b]).shape, np.stack([a, b], axis=1).shape, np.concatenate((a, b), axis=1)[0], np.column_stack([x, y, z])[1], np.r_[1, 2:5, [7, 8]], np.c_[x, y].ravel(), np.tile([1, 2], 2), np.tile([[1], [2]], (1, 2)).ravel(), np.repeat([1, 2], [2, 1]), np.repeat(a, 2, axis=0)[:, 0], np.append(a, [[9, 9, 9]], axis=0)[2], np.insert([1, 2, 3], 1, 9), np.delete([1, 2, 3], 1), p, q, l.ravel(), r.ravel()])
#%% indexing of all kinds
import numpy as np
a = np.arange(20).reshape(4, 5)
rows = np.array([0, 3])
out = np.concatenate([a[1:3, ::2].ravel(), a[::-1, -1], a[rows][:, [1, 4]].ravel(), a[rows, [1, 4]], a[a % 7 == 0], a[..., 2], a[:, None, 1].ravel(), a[np.ix_([0, 2], [1, 3])].ravel(), a[-1], a[a[:, 0] > 5, 1:3].ravel(), a.flat[3:6], np.take(a, [1, 2]), a[np.newaxis, 0].ravel(), np.diag(a), a[[True, False, False, True]][:, 0], np.compress([0, 1, 1, 0], a, axis=0)[:, 0]])
#%% assignment into arrays
import numpy as np
a = np.zeros((4, 4))
a[1] = 1
a[:, 2] += 2
a[a == 0] = -1
a[[0, 3], [0, 3]] = [10, 20]
a[2, 1:3] *= 5
a[3, ::2], a[0, 1] = 7, 8
np.fill_diagonal(a, 0)
b = a.copy(); b[b < 0] = np.nan
a[..., -1] = np.arange(4)
out = np.concatenate([a.ravel(), np.nan_to_num(b, nan=99.0).ravel()])
#%% reductions
import numpy as np
a = np.array([[3.0, -1, 2], [0.5, 4, -2]])
out = np.concatenate([[a.sum(), a.mean(), a.std(), a.var(), a.min(), a.max(), a.argmin(), a.argmax(), a.prod(), np.ptp(a), np.median(a), np.any(a > 3), np.all(a > -3), np.count_nonzero(a > 0), np.nansum([1, np.nan]), np.average([1, 2, 4], weights=[1, 1, 2])], a.sum(axis=0), a.mean(axis=1), a.max(axis=-1), a.argmax(axis=0), np.min(a, axis=0, keepdims=True).ravel(), a.cumsum(), np.cumprod(a, axis=1).ravel(), np.percentile(a, [25, 50]), np.quantile(a, 0.9, axis=1), np.diff(a, axis=1).ravel(), np.sum(a, axis=(0, 1), keepdims=True).ravel(), np.linalg.norm(a, axis=1), np.std(a, axis=0, ddof=1), np.nanmax([[1, np.nan]], axis=1), np.gradient([1, 4, 9, 16.0]), np.trapezoid([1, 2, 3], dx=0.5, ) * np.ones(1)])
#%% maths
import numpy as np
x = np.array([0.1, 0.5, 0.9])
out = np.concatenate([np.sin(x), np.cos(x), np.tan(x), np.arcsin(x), np.arccos(x), np.arctan(x), np.arctan2(x, 1), np.sinh(x), np.tanh(x), np.exp(x), np.log(x), np.log1p(x), np.expm1(x), np.sqrt(x), np.square(x), np.cbrt(x), np.power(x, 3), x ** -0.5, np.abs(-x), np.sign(x - 0.5), np.floor(10 * x), np.ceil(x), np.round(x, 0), np.rint(3 * x), np.trunc(5 * x), np.fix(-5 * x), np.mod(5 * x, 1), np.fmod(-5 * x, 1), np.clip(x, 0.2, 0.8), np.maximum(x, 0.3), np.minimum(x, 0.3), np.hypot(x, 1), np.degrees(x), np.interp([0.3, 0.7], x, x**2), np.reciprocal(x), np.negative(x), np.divide(x, 2), np.floor_divide(x, 0.2), np.around(x, 1), np.cumsum(x)[::-1], np.polyval([1, 2, 3], x), np.float_power(x, 2), np.positive(x)])
#%% linear algebra
import numpy as np
A = np.array([[4.0, 1], [2, 3]])
v = np.array([1.0, 2])
out = np.concatenate([A @ v, v @ A, np.dot(A, A).ravel(), np.matmul(A, v), np.inner(v, v) * np.ones(1), np.outer(v, v).ravel(), np.linalg.inv(A).ravel(), [np.linalg.det(A), np.trace(A), np.linalg.norm(A), np.vdot(v, v)], np.linalg.solve(A, v), np.cross([1, 0, 0], [[0, 1, 0], [0, 0, 1]]).ravel(), np.einsum('ij,j->i', A, v), np.einsum('ij,ij->i', A, A), np.einsum('ij,jk', A, A).ravel(), np.linalg.norm(A, axis=0), np.linalg.norm(v, ord=1) * np.ones(1), np.linalg.norm(v, np.inf) * np.ones(1)])
#%% sorting and sets
import numpy as np
a = np.array([3, 1, 2, 3, 1])
u, idx, counts = np.unique(a, return_index=True, return_counts=True)
b = np.array([[3, 1], [2, 5], [3, 0]])
out = np.concatenate([np.sort(a), np.argsort(a, kind="stable"), u, idx, counts, np.sort(b, axis=0).ravel(), b[b[:, 1].argsort()].ravel(), np.lexsort((b[:, 1], b[:, 0])), np.searchsorted([1, 2, 3], [0, 2, 4]), np.unique(b, axis=0).ravel(), np.isin(a, [1, 9]), np.union1d([1, 2], [2, 3]), np.intersect1d(a, [1, 2]), np.setdiff1d(a, [1]), np.bincount(a), np.digitize([0.5, 1.5], [0, 1, 2]), np.flatnonzero(a == 3), np.argwhere(b > 2).ravel(), np.nonzero(a > 1)[0], np.max(np.argpartition(a, 2)[:2]) * np.ones(1)])
#%% logic and comparison
import numpy as np
a, b = np.array([1, 2, 3]), np.array([3, 2, 1])
out = np.concatenate([a < b, a >= b, (a == 2) | (b == 1), ~(a > 1), np.logical_and(a > 1, b > 1), np.logical_not(a == 1), np.logical_or(a > 2, b > 2), np.isclose(a, a + 1e-9), [np.allclose(a, b), np.array_equal(a, a), bool((a > 0).all()), (a > 2).any(), (a > 1).sum()], np.isnan([1, np.nan]), np.isfinite([np.inf, 1]), np.isinf([np.inf]), np.where(a > b, a, b), np.equal(a, b), a != b, np.logical_xor([True, False], [True, True]), np.sign(-a)]).astype(float)
#%% grids
import numpy as np
X, Y = np.meshgrid([1, 2, 3], [10, 20])
I, J = np.indices((2, 3))
ox, oy = np.ogrid[0:2, 0:3]
m = np.mgrid[0:1:3j]
out = np.concatenate([X.ravel(), Y.ravel(), I.ravel(), J.ravel(), (ox * 10 + oy).ravel(), m, np.stack(np.meshgrid(np.arange(2), np.arange(2), np.arange(2), indexing="ij"), -1).reshape(-1, 3).ravel(), np.mgrid[0:2, 1:3].ravel(), np.meshgrid([1, 2], [3, 4], sparse=True)[0].ravel()])
#%% methods
import numpy as np
a = np.array([[1.5, -2.5], [3.0, 0.0]])
out = np.concatenate([a.tolist()[0], a.astype(int).ravel(), a.round().ravel(), a.clip(-1, 1).ravel(), a.dot([1, 1]), a.repeat(2)[:3], a.take([0, 3]), [a.item(2), a.size, a.ndim, len(a), a.trace(), a.squeeze().shape[0]], a.flatten("F"), a.nonzero()[0], np.array(a, copy=True).ravel(), a.swapaxes(0, 1).ravel(), a.diagonal(), a.cumprod(), a.argsort(axis=1).ravel(), a.all(axis=0), a.any(axis=1)])
#%% sort in place, fill
import numpy as np
a = np.array([3, 1, 2])
a.sort()
b = np.empty((2, 2)); b.fill(4)
c = a[::-1].copy()
c[::2] = c[::2] ** 2
np.random.seed(0)
out = np.concatenate([a, b.ravel(), c])
#%% dtypes
import numpy as np
a = np.array([1.9, -1.9])
out = np.array([a.astype(np.int32)[0], a.astype("int")[1], np.float32(0.1), np.int64(7) // 2, float(np.float64(2.5)), int(np.ceil(2.1)), np.array([1, 2]).dtype == np.int64, np.finfo(float).eps, np.iinfo(np.int64).max > 0, np.bool_(True), np.array([True, False]).sum(), np.asarray([1, 2], dtype=float).mean(), np.isscalar(3.0), np.array(5).item()])
#%% broadcasting
import numpy as np
a = np.arange(3)[:, None] + np.arange(2)[None]
d = np.linalg.norm(np.eye(3)[:, None] - np.ones((2, 3))[None], axis=-1)
out = np.concatenate([a.ravel(), d.ravel(), np.broadcast_to([1, 2], (2, 2)).ravel(), (np.ones((2, 1, 3)) * np.arange(4)[:, None]).sum(axis=(0, 2)), np.add.outer([1, 2], [10, 20]).ravel(), np.multiply([[1], [2]], [3, 4]).ravel(), np.subtract.outer([1, 2], [1]).ravel()])
#%% ufunc reductions and accumulations
import numpy as np
out = np.concatenate([[np.add.reduce([1, 2, 3]), np.multiply.reduce([2, 3, 4]), np.maximum.reduce([1, 5, 2])], np.add.accumulate([1, 2, 3]), np.minimum.accumulate([3, 1, 2]), np.apply_along_axis(lambda r: r.max() - r.min(), 1, np.array([[1, 5], [2, 9]])), np.vectorize(lambda v: v + 1 if v > 1 else 0)([1, 2, 3])])
#%% augmented assignment keeps views
import numpy as np
a = np.zeros((3, 3))
v = a[:, 1]
v += [1, 2, 3]
w = a[a > 1]
w *= 100
a.T[0] = 9
b = a
b -= 1
out = a.ravel()
#%% complex steps of slices
import numpy as np
a = np.arange(30).reshape(5, 6)
s = slice(1, None, 2)
out = np.concatenate([a[s, s].ravel(), a[slice(None), 0], a[-2::-2, -1], a[:, -3:-1].ravel(), a[4:0:-2, 5:0:-3].ravel(), a[np.s_[1:3, ...]].ravel()])
#%% minus zero is zero
import numpy as np
p = np.round(np.array([[-0.2, 1.0], [0.2, 1.0], [-0.2, 0.4], [3.0, -1.0]]))
q = p[np.lexsort((np.arange(4), p[:, 0]))]
out = np.concatenate([np.unique(p, axis=0).ravel(), np.unique(p), q.ravel(), np.isin([0.0, -0.0], [-0.0])])
#%% places along an axis
import numpy as np
a = np.arange(24).reshape(8, 3)[::-1] % 7
out = np.concatenate([a.compress([1, 0, 1], axis=0).ravel(), np.compress([0, 1], a, axis=1).ravel(), np.argpartition(a, 7, axis=0)[7], np.partition(a, 0, axis=1)[:, 0], np.inner(a, a[:2]).ravel(), [np.inner([1, 2], [3, 4])]])
#%% several axes at once
import numpy as np
a = np.arange(24).reshape(2, 4, 3)
out = np.concatenate([np.moveaxis(a, [0, 1], [1, 0]).ravel(), np.moveaxis(a, (0, 2), (-1, 0)).ravel(), np.expand_dims(a, (0, 3)).shape, np.expand_dims(a, -1).shape])
#%% single precision in arange
import numpy as np
out = np.concatenate([np.arange(0, 1, 0.1, dtype=np.float32), np.arange(-1, 1, 0.3, dtype="float32")])
#%% integers rounded to tens
import numpy as np
a = np.array([[15, 25, -15], [149, 150, 250]])
out = np.concatenate([np.round(a, -1).ravel(), a.round(-2).ravel(), np.round(a, 1).ravel(), [np.round(1234, -2)]])
