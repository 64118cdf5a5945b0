#%% numbers of numpy divide by zero
import numpy as np
a = np.array([0.0, 1.0, -8.0]); n = np.array([0, 3])
out = np.array([np.isinf(1.0/a[0]), np.isnan(a[0]/a[0]), np.isnan(a[2]**(1/3)), np.isinf(5/(n.sum()-3)), 7//(n[0]), (n[1]) % 2, n[1]/2, n[1]**2, a[2]//3, abs(a[2]), -a[2], abs(-3)//2, round(a[1]*2.6), n[1]*1.5, float(np.sqrt(2.0))/3, np.isnan(np.float64(0)/0), 2**n[1], True+n[1]])
#%% numbers of Python do not
import numpy as np
try:
    abs(-1.0)/0
    r = 1
except ZeroDivisionError as e:
    r = 2 if type(e).__name__ == 'ZeroDivisionError' else 3
try:
    [1.0, 0.0][0] / np.array([0.0]).tolist()[0]
    q = 1
except ZeroDivisionError: q = 2
out = np.array([r, q])
#%% imports that fail are caught
import numpy as np
try:
    import no_such_module
except ImportError:
    k = 1
try:
    from no_such_module.part import name
except (ImportError, ValueError):
    k += 1
try:
    from numpy import no_such_function
except ImportError:
    k += 1
out = np.array([k])
#%% draws of Python's random
import numpy as np
import random
random.seed(7)
l = list(range(30)); random.shuffle(l)
out = np.array([random.random(), random.uniform(2, 5), random.randint(1, 10**12), random.randrange(0, 100, 7), random.choice([5,6,7,8]), random.gauss(0, 1), random.gauss(1, 2), random.normalvariate(0, 3), random.getrandbits(40), random.getrandbits(3), random.expovariate(2.0), random.triangular(0, 1, 0.3), random.triangular()] + l + random.sample(range(1000), 5) + random.sample(range(20), 10) + random.choices([1,2,3], weights=[1, 2, 5], k=6) + random.choices([1,2,3], k=4) + [random.Random(12345678901).random(), random.Random(2**32).random(), random.lognormvariate(0, 1)])
#%% itertools, functools, collections
import numpy as np
import itertools as it
from itertools import product, chain
from functools import reduce, partial, lru_cache
from collections import defaultdict, Counter
out = np.array([list(t) for t in product([1,2],[3,4])]).ravel().tolist() + [sum(t) for t in it.combinations(range(4), 2)] + [a*10+b for a, b in it.permutations([1,2,3], 2)] + list(chain([1], [2,3])) + list(it.islice(it.count(3), 4)) + list(it.accumulate([1,2,3])) + list(it.accumulate([1,2,3], lambda a,b:a*b)) + list(chain.from_iterable([[1],[2]])) + [reduce(lambda a, b: a*b, [1,2,3,4]), partial(lambda a, b, c=0: a-b+c, 10, c=5)(3)] + list(it.repeat(2, 3)) + [len(list(it.product(range(2), repeat=3)))] + list(it.islice([1,2,3,4,5], 1, None, 2)) + [len(list(it.combinations_with_replacement('abc', 2))), len(list(it.permutations('abc')))]
d = defaultdict(list); d['a'].append(1); d['a'].append(2); d['b']
c = Counter([1,1,2])
@lru_cache(maxsize=None)
def fib(n): return n if n < 2 else fib(n-1) + fib(n-2)
out = np.array(out + [len(d), len(d['a']), c[1], c[7], len(c), fib(15), c.most_common(1)[0][0]])
#%% typing, copies, names and text
import numpy as np
from math import *
from typing import Tuple, Union, List, Optional, Callable, Any
from numpy.typing import NDArray
import numpy.typing as npt, warnings, time, sys, copy
Vec = Tuple[float, ...]
Num = Union[int, float]
M = float | None
Arr = npt.NDArray[np.float64]
warnings.filterwarnings("ignore")
t = time.time()
l = [1,2,3,4,5]; del l[1:3]
d = {1: 2} | {3: 4}; d |= {5: 6}
s = {1,2}; s.update([3], [4]); s.remove(1)
q = copy.deepcopy([[1,2],[3]]); q[0].append(9)
out = np.array([len(d), len(s), s.issubset({2,3,4,5}), len(l), l[1], sin(pi/6), 'l' in globals(), 'zz' in locals(), hasattr(np, 'zeros'), hasattr(np, 'zerosss'), len('a'.center(5)), int('7'.zfill(3)), len('ab '.rstrip()), isinstance(3, (int, float)), len(q[0]), f"{type(np.zeros(2))}" == "<class 'numpy.ndarray'>", f"{type(1)}" == "<class 'int'>", type(None).__name__ == 'NoneType', len('abc'.center(6, '*').rstrip('*')), np.zeros(2).dtype == float])
