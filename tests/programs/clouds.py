#%% ball by rejection in a while loop
import numpy as np
np.random.seed(0)
points = []
while len(points) < 500:
    p = np.random.uniform(-1, 1, 3)
    if np.linalg.norm(p) <= 1.0:
        points.append(p)
ball = np.array(points)
out = np.vstack([ball.mean(axis=0), ball.std(axis=0), ball[0], ball[-1]])
#%% ball by rejection in batches
import numpy as np
rng = np.random.default_rng(0)
batches, count = [], 0
while count < 2000:
    cand = rng.uniform(low=-1.0, high=1.0, size=(1000, 3))
    cand = cand[np.sum(cand**2, axis=1) <= 1.0]
    batches.append(cand)
    count += cand.shape[0]
ball = np.concatenate(batches, axis=0)[:2000]
out = np.vstack([ball.mean(axis=0), ball.min(axis=0), ball.max(axis=0), ball[-1]])
#%% ball with a helper class of functions and defaults
import numpy as np
from typing import List, Tuple, Optional

def sample_ball(n: int = 100, radius: float = 1.0, center: Tuple[float, float, float] = (0.0, 0.0, 0.0),
                rng: Optional[np.random.Generator] = None) -> np.ndarray:
    """Uniform points in a ball.

    Args:
        n: how many.
    """
    rng = rng or np.random.default_rng(1)
    v = rng.normal(0.0, 1.0, size=(n, 3))
    v /= np.linalg.norm(v, axis=-1, keepdims=True)
    return np.asarray(center) + v * radius * np.cbrt(rng.random(n))[:, np.newaxis]

ball: np.ndarray = sample_ball(n=300, center=(0.5, 0, -0.5))
out = np.array([*ball.mean(0), *ball.max(0)])
#%% disc on a sunflower
import math
import numpy as np
N, R, H = 400, 1.2, 0.5
golden = math.pi * (3.0 - math.sqrt(5.0))
pts = [[R * math.sqrt((i + 0.5) / N) * math.cos(i * golden), H * ((i * 7919) % N / N - 0.5),
        R * math.sqrt((i + 0.5) / N) * math.sin(i * golden)] for i in range(N)]
disc = np.asarray(pts, dtype=np.float64)
out = np.stack((disc.mean(0), disc[37], disc[-1]))
#%% grid in a cylinder, meshgrid ij
import numpy as np
xs = np.linspace(-1, 1, 21)
ys = np.linspace(-0.2, 0.2, 5)
X, Y, Z = np.meshgrid(xs, ys, xs, indexing='ij')
mask = (X**2 + Z**2) <= 1.0
cyl = np.column_stack((X[mask], Y[mask], Z[mask]))
out = np.array([cyl.shape[0], cyl.sum(), np.abs(cyl).sum(), cyl[100, 0]])
#%% grid by mgrid with complex steps
import numpy as np
g = np.mgrid[-1:1:9j, 0:1:3j, -1:1:9j]
pts = g.reshape(3, -1).T
keep = np.hypot(pts[:, 0], pts[:, 2]) < 0.8
out = np.r_[pts[keep].sum(axis=0), keep.sum(), pts.shape]
#%% ring in a square grid with where of one argument
import numpy as np
x, z = np.meshgrid(np.arange(-10, 11), np.arange(-10, 11))
r2 = x.ravel()**2 + z.ravel()**2
idx = np.where((r2 >= 16) & (r2 <= 81))[0]
ring = np.c_[x.ravel()[idx], np.zeros(len(idx)), z.ravel()[idx]] / 10.0
out = np.concatenate([ring.sum(axis=0), [len(idx)], ring[::50].ravel()])
#%% ellipsoid stretched and turned
import numpy as np
rs = np.random.RandomState(42)
u, v, w = rs.rand(3, 250)
r, th, ph = np.cbrt(u), np.arccos(1 - 2 * v), 2 * np.pi * w
xyz = np.array([r * np.sin(th) * np.cos(ph), r * np.cos(th), r * np.sin(th) * np.sin(ph)])
a = np.deg2rad(30)
rot = np.array([[np.cos(a), 0, np.sin(a)], [0, 1, 0], [-np.sin(a), 0, np.cos(a)]])
cloud = (rot @ np.diag([2.0, 0.5, 0.5]) @ xyz).T + np.array([[1, 2, 3]])
out = np.vstack([cloud.mean(0), cloud.std(0, ddof=1), np.median(cloud, axis=0)])
#%% four cookies in a loop, dict of clouds
import numpy as np
rng = np.random.default_rng(3)
centers = {f"cookie_{i + 1}": np.array([sx * 0.8, 0.0, sz * 0.8])
           for i, (sx, sz) in enumerate([(1, 1), (1, -1), (-1, 1), (-1, -1)])}
clouds = {}
for name, c in centers.items():
    t = rng.uniform(0, 2 * np.pi, 50)
    r = 0.3 * np.sqrt(rng.uniform(0, 1, 50))
    clouds[name] = np.stack([r * np.cos(t), np.zeros_like(t), r * np.sin(t)], axis=1) + c
out = np.array([clouds[k].mean(axis=0) for k in sorted(clouds.keys(), reverse=True)])
#%% torus by rejection with a generator expression
import numpy as np
rng = np.random.default_rng(12)
R, r = 1.0, 0.4
def inside(p):
    return (np.sqrt(p[0]**2 + p[2]**2) - R)**2 + p[1]**2 <= r * r
cand = rng.uniform([-R - r, -r, -R - r], [R + r, r, R + r], size=(800, 3))
donut = np.array([p for p in cand if inside(p)])
out = np.array([len(donut), *donut.sum(axis=0)])
#%% halves of a bar and their shift
import numpy as np
rng = np.random.default_rng(0)
bar = rng.uniform(-0.5, 0.5, size=(1000, 3)) * [1.0, 0.4, 0.4]
left, right = bar[bar[:, 0] < 0].copy(), bar[bar[:, 0] >= 0].copy()
left[:, 0] -= 0.5
right[..., 0] += 0.5
left_half, right_half = left, right
out = np.array([left_half.shape[0], left_half[:, 0].max(), right_half[:, 0].min(), right_half.mean()])
#%% stack of layers
import numpy as np
layers = []
for k, y in enumerate(np.linspace(-0.1, 0.1, num=4, endpoint=True)):
    n = 20 + 5 * k
    t = np.linspace(0, 2 * np.pi, n, endpoint=False)
    layers.append(np.vstack((np.cos(t), np.full(n, y), np.sin(t))).T)
disc = np.vstack(layers)
out = np.append(disc.sum(axis=0), disc.shape)
#%% sobol-like sequences by repeated addition
import numpy as np
phi = 1.2207440846057596
alpha = np.array([1 / phi, 1 / phi**2, 1 / phi**3]) % 1
z = np.zeros((200, 3))
for i in range(200):
    z[i] = (0.5 + alpha * (i + 1)) % 1
bar = (z - 0.5) * np.array((1, 0.4, 0.4))
out = np.array([bar.mean(0), bar.min(0), bar.max(0)]).flatten()
#%% halton numbers by hand
import numpy as np
def halton(index, base):
    f, result = 1.0, 0.0
    while index > 0:
        f /= base
        result += f * (index % base)
        index //= base
    return result
out = np.array([[halton(i, b) for b in (2, 3, 5)] for i in range(1, 9)])
#%% triangle inequality of shells
import numpy as np
n_r, n_t = 6, 12
r_edges = np.sqrt(np.linspace(0, 1, n_r + 1))
r_mid = 0.5 * (r_edges[:-1] + r_edges[1:])
rr, tt = np.meshgrid(r_mid, np.linspace(0, 2 * np.pi, n_t, endpoint=False))
disc = np.stack([(rr * np.cos(tt)).ravel(), np.zeros(rr.size), (rr * np.sin(tt)).ravel()], axis=-1)
out = np.array([disc.shape[0], *disc.var(axis=0), disc[-1, 2]])
#%% pretzel of segments
import numpy as np
t = np.linspace(0, 1, 30)
A, B = np.array([0, 0, 0.0]), np.array([1, 0, 2.0])
path = A[None, :] * (1 - t)[:, None] + B * t[:, None]
tangent = (B - A) / np.linalg.norm(B - A)
normal = np.cross(tangent, [0, 1, 0])
tube = np.concatenate([path + 0.1 * k * normal for k in range(-2, 3)])
out = np.vstack([tube[::25], normal])
#%% cut off the corners
import numpy as np
i, j, k = np.indices((6, 4, 6))
pts = np.stack([i, j, k], axis=-1).reshape(-1, 3).astype(float)
pts = pts[np.any(pts < 3, axis=1) & ~np.all(pts == 0, axis=1)]
pts -= pts.mean(axis=0)
out = np.array([len(pts), pts.max(), np.abs(pts).sum(), np.ptp(pts[:, 1])])
#%% points closest to a place
import numpy as np
pts = np.random.default_rng(9).random((100, 3))
order = np.argsort(np.linalg.norm(pts - np.array([0.5, 0.5, 0.5]), axis=1))
near = np.take(pts, order[:4], axis=0)
out = np.hstack([near, order[:4].reshape(-1, 1)])
#%% resampling with choice and jitter
import numpy as np
rng = np.random.default_rng(21)
base = np.arange(30, dtype=float).reshape(10, 3)
pick = rng.choice(len(base), size=25, replace=True)
cloud = base[pick] + rng.normal(scale=0.01, size=(25, 3))
sub = cloud[rng.permutation(25)[:5]]
out = sub
#%% centre and scale to a volume
import numpy as np
V = 4 / 3 * np.pi
shape = np.array([2.0, 1.0, 1.0])
k = (V / np.prod(shape)) ** (1 / 3)
half = shape * k / 2
rng = np.random.default_rng(5)
loaf = np.column_stack([rng.uniform(-h, h, 64) for h in half])
loaf -= loaf.mean(axis=0, keepdims=True)
out = np.array([k, *half, *loaf.max(axis=0)])
