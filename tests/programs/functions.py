#%% gradients along axes and with uneven spacing
import numpy as np
y = np.array([1.0, 4, 9, 16, 30]); t = np.array([0.0, 1, 3, 4, 8]); m = np.arange(12.0).reshape(3, 4)**2
gx, gy = np.gradient(m)
out = np.concatenate([np.gradient(y, t), np.gradient(y, 0.5), np.gradient(m, axis=0).ravel(), np.gradient(m, 2.0, axis=1).ravel(), gx.ravel(), gy.ravel(), np.gradient(y, t, edge_order=2), np.gradient(y, edge_order=2), np.gradient(m, [0, 1, 3], [0, 1, 2, 4])[1].ravel(), np.gradient(m, 1, 2, axis=(0, 1))[1].ravel(), np.gradient(y, np.arange(5))])
#%% out and where of functions on elements
import numpy as np
a = np.array([1.0, 2, 3]); b = np.array([1.0, 0, 2]); z = np.zeros(3); o = np.full(3, 7.0)
r = np.divide(a, b, out=z, where=b != 0)
np.add(a, b, o)
q = np.sqrt(a, out=np.empty(3))
w = np.array([1.0, 5, 9]); np.clip(w, 2, 6, out=w)
k = np.array([[1.0, -2], [3, -4]]); np.abs(k, out=k);
lg = np.log(a, out=np.zeros_like(a), where=a > 1.5)
mx = np.empty(3); np.maximum(a, 2, out=mx)
out = np.concatenate([r, z, o, q, w, k.ravel(), lg, mx, np.add(1, 2, dtype=float) * np.ones(1), np.floor(np.array([1.5]), out=np.zeros(1)), np.round(np.array([1.25, 2.5]), 1)])
#%% roots and polynomials
import numpy as np
x = np.linspace(-1, 1, 9); y = 2*x**2 - 3*x + 1
out = np.concatenate([np.roots([1, -6, 11, -6]), np.roots([2.0, 0, -8]), np.roots([1, 0, 0]), np.roots([3.0, 6]), np.roots([1, -3, 2]).real, np.polyfit(x, y, 2) , np.polyfit(x, np.sin(x), 3), np.poly1d([1, 2, 3])(np.array([1.0, 2])), np.polyfit(x, y, 1, w=np.arange(1, 10.0))])
#%% einsum with ellipses
import numpy as np
A = np.arange(24.0).reshape(2, 3, 4); B = np.arange(12.0).reshape(3, 4); R = np.arange(9.0).reshape(3, 3); P = np.arange(12.0).reshape(4, 3)
out = np.concatenate([np.einsum('...i,...i->...', A, B).ravel(), np.einsum('ij,...j->...i', R, P).ravel(), np.einsum('...j,jk->...k', A, P).ravel(), np.einsum('...i->...', A).ravel(), np.einsum('...ij', A).ravel(), np.einsum('i...->...', A).ravel(), np.einsum('...i,...i', P, P)])
#%% insert, delete, pad
import numpy as np
xz = np.arange(6.0).reshape(3, 2); y = np.array([7.0, 8, 9])
out = np.concatenate([np.insert(xz, 1, y, axis=1).ravel(), np.insert(xz, 0, 5, axis=0).ravel(), np.insert([1, 2, 3], [0, 2], [8, 9]), np.insert([1, 2, 3], 1, [8, 9]), np.insert(xz, [1], [[1], [2], [3]], axis=1).ravel(), np.insert([1,2,3], -1, 5), np.delete(np.arange(10), np.s_[::2]), np.delete(xz, np.s_[:1], axis=0).ravel(), np.pad([1, 2], 2), np.pad(xz, ((1, 0), (0, 2)), mode='constant', constant_values=9).ravel(), np.pad([1, 2, 3], (2, 3), mode='edge'), np.pad([1, 2, 3], (2, 4), mode='reflect'), np.pad([1, 2, 3], (2, 4), 'symmetric'), np.pad([1, 2, 3], (4, 4), 'wrap'), np.pad(xz, 1, 'edge').ravel(), np.delete([1,2,3], [0,-1])])
#%% places in arrays and add.at
import numpy as np
i, j = np.unravel_index([5, 7], (3, 4)); p = np.unravel_index(np.argmax([[1, 5], [2, 3]]), (2, 2))
r, c = np.triu_indices(4, k=1); r2, c2 = np.tril_indices(3); d = np.diag_indices(3)
q = np.zeros(4); np.add.at(q, [0, 1, 1, 3], 2.5); h = np.zeros((2, 2), dtype=int); np.add.at(h, ([0, 0, 1], [1, 1, 0]), [1, 2, 3]); np.subtract.at(q, np.array([0]), 1)
out = np.concatenate([i, j, p, r, c, r2, c2, d[0], d[1], q, h.ravel(), np.ravel_multi_index(([1, 2], [3, 0]), (3, 4)), [sum(ix) for ix in np.ndindex(2, 3)], [ix[0]*10 + v for ix, v in np.ndenumerate(np.array([5, 6]))]])
#%% histograms
import numpy as np
rng = np.random.default_rng(0); x = rng.normal(size=300)
h, e = np.histogram(x); h2, e2 = np.histogram(x, bins=7, range=(-2, 2)); h3, e3 = np.histogram(x, bins=[-1, 0, 0.5, 3], density=True); h4, _ = np.histogram([1, 2, 2, 3], bins=2, weights=[1, 2, 3, 4.0]); h5, e5 = np.histogram(np.arange(11)/10, bins=10)
out = np.concatenate([h, e, h2, e2, h3, h4, h5, np.histogram([2.0, 2.0], bins=2)[0]])
#%% covariances, convolutions, partial sums
import numpy as np
rng = np.random.default_rng(1); P = rng.normal(size=(40, 3))
out = np.concatenate([np.cov(P.T).ravel(), np.cov(P, rowvar=False, bias=True).ravel(), np.corrcoef(P.T).ravel(), [np.cov(P[:, 0]), np.sum([1, 2, 3], where=[True, False, True]), np.max([1, 2], initial=9), np.min([[1, 2], [3, 0]], axis=1, initial=1).sum(), np.sum([1, 2], initial=10), np.prod([2, 3], where=[False, True])], np.percentile(P, 30, axis=0, keepdims=True).ravel(), np.convolve([1, 2, 3], [0, 1, 0.5]), np.convolve(np.arange(6.0), np.ones(3)/3, mode='same'), np.convolve([1, 2, 3], [0, 1], 'valid'), np.convolve([1,2], [1,2,3,4], 'same'), np.sum(P, axis=0, where=P > 0), np.max(P, axis=0, initial=0)])
#%% decompositions of matrices
import numpy as np
rng = np.random.default_rng(2); A = rng.normal(size=(6, 3)); S = A.T @ A; b = rng.normal(size=6)
U, s, Vt = np.linalg.svd(A, full_matrices=False); U2, s2, Vt2 = np.linalg.svd(A); w, V = np.linalg.eigh(S); Q, R = np.linalg.qr(A); Qc, Rc = np.linalg.qr(A, mode='complete')
x, res, rank, sv = np.linalg.lstsq(A, b, rcond=None); X2 = np.linalg.lstsq(A, np.stack([b, 2*b], 1), rcond=None)
_, _, Wt = np.linalg.svd(A.T)
out = np.concatenate([s, s2, (U * s @ Vt).ravel(), (U2[:, :3] * s2 @ Vt2).ravel(), (U2.T @ U2).ravel(), U2.shape, Wt.shape, (Wt @ Wt.T).ravel(), w, (V * w @ V.T).ravel(), np.linalg.eigvalsh(S), Q.ravel(), R.ravel(), Qc.shape, Rc.shape, (Qc @ Rc).ravel(), np.linalg.pinv(A).ravel(), x, res, [rank], sv, X2[0].ravel(), X2[1], [np.linalg.matrix_rank(A), np.linalg.matrix_rank(np.ones((3, 3))), np.linalg.cond(A)], np.linalg.cholesky(S).ravel(), np.kron(np.eye(2), [[1, 2], [3, 4]]).ravel()])
#%% cross products, folds and keywords
import numpy as np
out = np.concatenate([np.cross([1, 2], [3, 4, 5]), np.cross([[1, 2, 3]], [[4, 5, 6]]).ravel(), np.cross(np.arange(6.0).reshape(3, 2), np.ones((3, 2)), axis=0).ravel(), np.logical_and.reduce([[True, True], [False, True]], axis=1), np.logical_and.reduce([np.array([True, False]), np.array([True, True])]), np.add.reduce(np.arange(6).reshape(2, 3), axis=1), np.add.accumulate([[1, 2], [3, 4]], axis=1).ravel(), np.maximum.reduce([np.array([1, 5]), np.array([3, 2])]), [np.add.reduce([[1, 2], [3, 4]], axis=None)], np.multiply.accumulate([1, 2, 3]), np.interp([-1, 0.5, 3], [0, 1], [10, 20], left=-5, right=99), np.vectorize(lambda v: v * 2, otypes=[float])([1, 2]), np.fromiter((i for i in range(3)), dtype=float, count=3), np.array([1, 2], order='C'), np.meshgrid([1, 2], [3], copy=False)[0].ravel(), np.nan_to_num([np.nan, np.inf, -np.inf], nan=1, posinf=2, neginf=3), [np.allclose([np.nan], [np.nan], equal_nan=True), np.array(5.0)[()], np.zeros(2)[()].sum(), np.linalg.norm(np.array([3, 4])[...])]])
#%% piecewise functions
import numpy as np
x = np.linspace(-2, 2, 9)
out = np.concatenate([np.piecewise(x, [x < 0, x >= 1], [lambda v: -v, lambda v: v**2, 0.5]), np.piecewise(x, [x < 0, x >= 0], [-1, 1])])
#%% what cannot be decomposed
import numpy as np
try:
    np.linalg.svd(np.array([[np.nan, 1], [1, 2]])); r = 0
except np.linalg.LinAlgError: r = 1
try:
    np.linalg.cholesky(-np.eye(2)); q = 0
except np.linalg.LinAlgError: q = 1
out = np.array([r, q])
