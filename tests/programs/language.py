#%% no import of numpy
out = np.array([np.pi, math.pi, np.e])
#%% main guard and global constants
import numpy as np
RADIUS = 1.0
_counter = 0
def build(n):
    global _counter
    _counter += 1
    return np.full((n, 3), RADIUS * _counter)
if __name__ == "__main__":
    a = build(2)
    b = build(n=1)
    out = np.vstack([a, b])
#%% try, except, else, finally
import numpy as np
log = []
try:
    x = 1 / 0
except ZeroDivisionError as e:
    log.append(len(str(e)) > 0)
else:
    log.append("no")
finally:
    log.append(2)
try:
    y = int("3")
except (ValueError, TypeError):
    y = -1
else:
    y += 1
try:
    np.zeros(3)[5]
except IndexError:
    y *= 10
out = np.array([float(log[0]), log[1], y])
#%% walrus, ternary, chained comparison
import numpy as np
data = [3, 8, 1, 9]
if (n := len(data)) > 3:
    big = [v for v in data if 2 < v <= 8]
mode = "even" if n % 2 == 0 else "odd"
out = np.array([n, sum(big), len(mode), (m := max(data)) * 2, m])
#%% star unpacking everywhere
import numpy as np
first, *middle, last = range(6)
def total(*args, scale=1.0, **kwargs):
    return scale * sum(args) + sum(kwargs.values())
values = (*middle, last)
options = {"a": 1, **{"b": 2}}
out = np.array([first, last, *middle, total(*values, scale=2, **options), total(1, x=2)])
#%% nested functions and closures
import numpy as np
def make_scaler(k):
    count = 0
    def scale(v):
        nonlocal count
        count += 1
        return np.asarray(v) * k * count
    return scale
double = make_scaler(2)
out = np.concatenate([double([1, 2]), double([1, 2])])
#%% lambda, map, filter, sorted, key
import numpy as np
pieces = [("left", 0.3), ("right", 0.1), ("middle", 0.2)]
by_size = sorted(pieces, key=lambda p: p[1])
area = lambda r, h=0.5: np.pi * r**2 * h
sizes = list(map(lambda p: p[1], filter(lambda p: p[0] != "right", by_size)))
biggest = max(pieces, key=lambda p: p[1])
out = np.array([area(1), area(2, h=1), *sizes, len(biggest[0]), min(p[1] for p in pieces)])
#%% strings and f-strings
import numpy as np
name = "half_left"
label = f"{name.upper():>12}|{3.14159:.2f}|{7:03d}|{1e6:,.0f}|{0.5:.0%}|{name!r}|{'x'*3:^7}"
parts = "a, b,c".split(",")
clean = [p.strip() for p in parts]
text = "-".join(clean).replace("a", "z").title()
s = "Step %d: %s has %.3f" % (2, name, 0.12345)
out = np.array([len(label), label.count("|"), len(text), text.find("C"), name.startswith("half"), "left" in name, len(s), "{:.1f} {}".format(2.55, "k").index("k")])
#%% dict and set work
import numpy as np
vol = dict(ball=4.19, disc=4.18)
vol["ring"] = vol.get("ring", 0) + 1
vol.update({"ball": 4.2})
removed = vol.pop("disc")
vol.setdefault("cake", []).append(3)
keys = {k for k in vol} | {"extra"}
inverse = {str(v): k for k, v in vol.items() if not isinstance(v, list)}
out = np.array([vol["ball"], vol["ring"], removed, len(keys), len(inverse), "cake" in vol, len(vol["cake"]), len(keys & {"ball", "no"})])
#%% while with break, continue, else
import numpy as np
k, odd = 0, []
while True:
    k += 1
    if k % 2 == 0:
        continue
    if k > 9:
        break
    odd.append(k)
for v in odd:
    if v == 100:
        break
else:
    odd.append(-1)
out = np.array(odd)
#%% zip, enumerate, reversed, ranges
import numpy as np
rows = []
for i, (a, b) in enumerate(zip([1, 2, 3], (4.0, 5.0, 6.0)), start=1):
    rows.append((i, a, b))
for j in reversed(range(0, 10, 4)):
    rows.append((j, -j, j / 2))
cols = list(zip(*rows))
out = np.array(cols, dtype=float)
#%% comprehension in comprehension
import numpy as np
table = [[r * c for c in range(1, 4)] for r in range(1, 4) if r != 2]
flat = [v for row in table for v in row if v % 2]
pairs = {(i, j): i + j for i in range(2) for j in range(2)}
out = np.array(flat + [pairs[1, 1], sum(sum(row) for row in table)])
#%% slices with steps and assignment to slices
import numpy as np
a = list(range(10))
a[2:5] = [20, 30]
del a[-1]
b = a[::-2]
t = tuple(a)[1:6:2]
out = np.array(a + b + list(t))
#%% integers, floats, bits, rounding
import numpy as np
out = np.array([7 // 2, -7 // 2, -7 % 3, 7.5 // 2, 2**-1, 1 << 5, 0xff & 0b1010, round(2.5), round(-3.7), round(3.14159, 2), int(-3.9), abs(-4), divmod(17, 5)[1], float("1e-3"), 1_000, 5 ^ 3, ~2, True + True])
#%% math module
import math
import numpy as np
out = np.array([math.sqrt(2), math.pow(2, 0.5), math.hypot(3, 4), math.atan2(1, -1), math.degrees(math.pi), math.radians(180), math.ceil(1.2), math.floor(-1.2), math.trunc(-1.7), math.exp(1), math.log(8, 2), math.log10(100), math.log2(8), math.cbrt(27), math.fmod(7, 3), math.fsum([0.1] * 10), math.isclose(0.1 + 0.2, 0.3), math.factorial(5), math.tau, math.comb(5, 2), math.dist((0, 0), (3, 4)), math.prod([2, 3, 4]), math.gcd(12, 18), math.copysign(1, -0.0), math.inf > 1, math.isfinite(1.0)])
#%% from imports and aliases
from math import sin as s, cos, pi
import numpy
import numpy.random as npr
from numpy import linspace, array
from numpy.linalg import norm
from numpy.random import default_rng
rng = default_rng(3)
npr.seed(1)
out = array([s(pi / 6), cos(pi / 3), norm([3.0, 4.0]), linspace(0, 1, 3)[1], rng.random(), npr.rand(), numpy.sqrt(2)])
#%% recursion
import numpy as np
def subdivide(lo, hi, depth):
    if depth == 0:
        return [(lo + hi) / 2]
    mid = (lo + hi) / 2
    return subdivide(lo, mid, depth - 1) + subdivide(mid, hi, depth - 1)
out = np.array(subdivide(0.0, 1.0, 3))
#%% assertions, pass, del, multiple assignment
import numpy as np
a = b = c = 0
a += 1; b -= 2; c = a; c **= 3; c |= 4; c //= 2
x, (y, z) = 1, (2, 3)
assert a == 1, f"a is {a}"
if x: pass
tmp = [1, 2, 3]
del tmp[0], a
def nothing(): ...
out = np.array([b, c, x, y, z, len(tmp), nothing() is None])
#%% any, all, sum of generator, min with default
import numpy as np
v = [0.5, -1.0, 2.0]
out = np.array([any(x < 0 for x in v), all(x > -2 for x in v), sum(x * x for x in v), min((x for x in v if x > 9), default=-5), max(v, default=0), sum(v, 10), len(set(map(abs, v)))])
#%% dataclass-free records as tuples and dicts
import numpy as np
piece = {"name": "disc", "size": (1.2, 0.5), "tags": ["flat", "round"]}
(r, h), tags = piece["size"], piece["tags"]
tags.extend(["cold"])
tags.insert(0, "first")
tags.sort(key=len, reverse=True)
out = np.array([r, h, len(tags), tags.index("cold"), len(tags[0]), np.pi * r**2 * h])
#%% printing in every way
import numpy as np
a = np.arange(3)
print("a:", a, a.shape, sep=" | ", end="\n\n")
print(f"{a=}", f"{a.mean():.3f}", *a)
print()
print({"x": a.sum()}, [1.0, 2], (3,), None, True)
np.set_printoptions(precision=3, suppress=True)
out = a
#%% conditional expression on arrays
import numpy as np
x = np.linspace(-2, 2, 5)
y = np.where(x < 0, -x, x**2)
z = np.select([x < -1, x < 1], [0, 1], default=2)
out = np.stack([x, y, z])
#%% string formatting of numbers used as keys
import numpy as np
sizes = {}
for i in range(3):
    sizes[f"piece_{i:02d}"] = np.ones((i + 1, 3)) * i
out = np.array([sizes["piece_02"].sum(), len(sizes), sum(v.shape[0] for v in sizes.values())])
#%% isinstance, type, callable, getattr-free checks
import numpy as np
a = np.zeros(2)
out = np.array([isinstance(a, np.ndarray), isinstance(3, (int, float)), isinstance("a", str), type(3) == int, type([]) is list, callable(len), a is not None, 3 in [1, 2, 3], 4 not in (1, 2), bool([]), not {}], dtype=float)
#%% texts of values in f-strings
import numpy as np
n, r = 10, 0.123456
out = np.array([len(f"{n=}"), len(f"{n = }"), len(f"{r=:.2f}"), len(f"{n:x}|{n:b}|{n:03d}"), len(f"{'a'=}")], dtype=float)
#%% messages of exceptions, singular matrices, quiet contexts
import numpy as np
try:
    raise ValueError("too thin")
except ValueError as e:
    a = len(str(e))
try:
    np.linalg.inv(np.zeros((2, 2)))
except np.linalg.LinAlgError:
    b = 4
try:
    np.linalg.solve(np.zeros((2, 2)), [1, 2])
except ValueError:
    c = 5
with np.errstate(divide="ignore", invalid="ignore"):
    d = np.isinf(np.array([1.0]) / 0).sum()
x = [1, 2, 3, 2]
x.remove(2)
out = np.array([a, b, c, d, *x], dtype=float)
#%% more of math
import math
import numpy as np
out = np.array([math.hypot(1, 2, 3), math.hypot(3, 4), math.expm1(0.1), *math.modf(2.75), *math.modf(-2.75)], dtype=float)
