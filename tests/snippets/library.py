# The standard library beside numpy: every assertion holds in CPython too (tests/tools/snippets.sh checks them).
import copy
import functools
import itertools
import random
import sys
import time
import warnings
from collections import Counter, defaultdict
from collections.abc import Iterable
from math import *
from typing import Callable, List, Optional, Tuple, Union

import numpy as np
import numpy.typing as npt
from numpy.typing import NDArray

Vec = Tuple[float, ...]
Number = Union[int, float]
Maybe = Optional[Callable[[float], List[float]]]
Field = NDArray[np.float64] | None
warnings.filterwarnings("ignore")
start = time.time()
assert time.time() - start >= 0 and sin(pi / 2) == 1 and floor(2.5) == 2 and sys.maxsize > 2**60

# draws
random.seed(0)
assert [random.random() for _ in range(3)] == [0.8444218515250481, 0.7579544029403025, 0.420571580830845]
random.seed(42)
assert random.random() == 0.6394267984578837 and random.uniform(0, 1) == 0.025010755222666936
random.seed(0)
assert [random.randint(1, 100) for _ in range(5)] == [50, 98, 54, 6, 34]
mixed = list(range(8))
random.Random(3).shuffle(mixed)
assert sorted(mixed) == list(range(8)) and random.choice("aaa") == "a" and len(random.sample(range(100), 5)) == 5

# itertools, functools, collections
assert list(itertools.product("ab", [1, 2])) == [("a", 1), ("a", 2), ("b", 1), ("b", 2)]
assert list(itertools.combinations([1, 2, 3], 2)) == [(1, 2), (1, 3), (2, 3)] and list(itertools.permutations([1, 2])) == [(1, 2), (2, 1)]
assert list(itertools.chain([1], (2, 3))) == [1, 2, 3] and list(itertools.accumulate([1, 2, 3])) == [1, 3, 6]
assert list(itertools.islice(itertools.count(5, 2), 3)) == [5, 7, 9] and list(itertools.islice("abcdef", 1, 5, 2)) == ["b", "d"]
assert list(itertools.repeat(1, 3)) == [1, 1, 1] and list(itertools.pairwise([1, 2, 3])) == [(1, 2), (2, 3)]
assert [k for k, _ in zip(itertools.count(), "abc")] == [0, 1, 2] and list(itertools.product([1], [])) == []
assert functools.reduce(lambda a, b: a * b, [1, 2, 3, 4]) == 24 and functools.partial(pow, 2)(5) == 32


@functools.lru_cache(maxsize=None)
def fib(n):
    return n if n < 2 else fib(n - 1) + fib(n - 2)


assert fib(15) == 610 and fib.__name__ == "fib"
groups = defaultdict(list)
groups["a"].append(1)
assert len(groups["b"]) == 0 and sorted(groups) == ["a", "b"]
counts = Counter("abca")
assert counts["a"] == 2 and counts["z"] == 0 and "z" not in counts and counts.most_common(1) == [("a", 2)]
nested = [[1, 2], {"k": [3]}]
deep, shallow = copy.deepcopy(nested), copy.copy(nested)
nested[0].append(9)
assert deep == [[1, 2], {"k": [3]}] and shallow[0] == [1, 2, 9]

# imports that fail, exceptions that go on
try:
    import no_such_module.part
    found = True
except ImportError as e:
    found = type(e).__name__
assert found == "ModuleNotFoundError"
try:
    from numpy import no_such_name
except ImportError:
    found = False
assert found is False


def again():
    try:
        {}["k"]
    except KeyError:
        raise


try:
    again()
except LookupError as e:
    caught = f"{type(e).__name__}"
assert caught == "KeyError" and f"{type(np.zeros(2))} {type(1.0)}" == "<class 'numpy.ndarray'> <class 'float'>"
assert type(np.zeros(2)) == np.ndarray and type(None).__name__ == "NoneType" and type([]) is list

# names
evens = [last for k in range(6) if (last := k) % 2 == 0]
assert last == 5 and evens == [0, 2, 4]
assert isinstance(prod([2, 3]), int) and "evens" in globals() and "missing" not in locals() and hasattr(np, "zeros")
assert not hasattr(np, "no_such_name") and getattr(np, "no_such_name", 7) == 7

# lists, dicts, sets, text
numbers = [1, 2, 3, 4, 5, 6]
del numbers[1:3]
del numbers[::2]
assert numbers == [4, 6] and {"a": 1} | {"b": 2} == {"a": 1, "b": 2}
some = {1, 2}
some.update([3], (4,))
some.remove(1)
assert some == {2, 3, 4} and {2}.issubset(some) and some.issuperset({3}) and some.isdisjoint({9})
assert "x".center(4, "*") == "*x**" and "ab".ljust(4) + "|" == "ab  |" and "7".zfill(3) == "007" and "-7".zfill(4) == "-007"
assert " a ".rstrip() == " a" and " a ".lstrip() == "a " and "xxaxx".strip("x") == "a" and "ab".rjust(3) == " ab"

# numbers of numpy where Python's would fail
a = np.array([0.0, 1.0, -8.0])
with np.errstate(all="ignore"):
    assert 1.0 / a[0] == np.inf and np.isnan(a[0] / a[0]) and np.isnan(a[2] ** (1 / 3)) and 7 // np.array([0])[0] == 0
    assert a.sum() / 0 == -np.inf and np.float64(1) / 0 == np.inf
for bad in (lambda: 1.0 / float(a[0]), lambda: 1 / 0, lambda: abs(-1.0) / 0, lambda: 1.0 / a.tolist()[0]):
    try:
        bad()
        caught = False
    except ZeroDivisionError:
        caught = True
    assert caught
