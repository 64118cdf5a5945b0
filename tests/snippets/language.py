# Python itself: every assertion holds in CPython too (tests/tools/snippets.sh runs it there).
import math
from math import pi, sqrt

# numbers
assert 7 // 2 == 3 and -7 // 2 == -4 and -7 % 3 == 2 and 7 % -3 == -2
assert 2 ** 10 == 1024 and 2 ** -1 == 0.5 and 7 / 2 == 3.5
assert 1 << 4 == 16 and 0b101 | 2 == 7 and 6 & 3 == 2 and 6 ^ 3 == 5 and ~5 == -6
assert round(2.5) == 2 and round(3.5) == 4 and round(2.675, 2) == 2.67 and round(-1234.5, -2) == -1200.0
assert abs(-3) == 3 and min(3, 1, 2) == 1 and max([3, 1, 2]) == 3 and sum([1, 2, 3.5]) == 6.5
assert divmod(7, 3) == (2, 1) and pow(2, 3) == 8 and int("12") == 12 and float("1.5") == 1.5 and int(-2.7) == -2
assert isinstance(3, int) and isinstance(True, int) and not isinstance(3.0, int) and isinstance("a", (int, str))
assert 1 < 2 < 3 and not 1 < 3 < 2 and (1 if 0 else 2) == 2 and (0 or "x") == "x" and (1 and 0) == 0
assert math.floor(-0.5) == -1 and math.ceil(0.2) == 1 and math.hypot(3, 4) == 5.0 and sqrt(4) == 2.0
assert math.isclose(math.cos(pi), -1.0) and math.factorial(5) == 120 and math.gcd(12, 18) == 6

# sequences
a = [1, 2, 3, 4, 5]
assert a[::-1] == [5, 4, 3, 2, 1] and a[1:4:2] == [2, 4] and a[-1] == 5 and a[:-2] == [1, 2, 3]
a[1:3] = [9]
assert a == [1, 9, 4, 5]
a += [6]
b = a
b.append(7)
assert a[-1] == 7 and len(a) == 6 and a.index(9) == 1 and a.count(4) == 1
del a[0]
assert a == [9, 4, 5, 6, 7] and a.pop() == 7 and sorted(a, reverse=True) == [9, 6, 5, 4]
assert sorted(["bb", "a", "ccc"], key=len) == ["a", "bb", "ccc"] and sorted([3, 1], key=lambda v: -v) == [3, 1]
assert [0] * 3 == [0, 0, 0] and (1, 2) + (3,) == (1, 2, 3) and [1, 2] < [1, 3] and (1, 2) == (1, 2)
first, *rest = [1, 2, 3]
(x, y), z = (1, 2), 3
assert rest == [2, 3] and x + y + z == 6
x, y = y, x
assert (x, y) == (2, 1)
assert [i * j for i in range(3) for j in range(3) if i < j] == [0, 0, 2]
assert {k: v for k, v in zip("ab", [1, 2])} == {"a": 1, "b": 2}
assert list(map(lambda v: v * 2, [1, 2])) == [2, 4] and list(filter(None, [0, 1])) == [1]
assert list(enumerate("ab", 1)) == [(1, "a"), (2, "b")] and list(reversed([1, 2])) == [2, 1]
assert sum(i for i in range(5)) == 10 and any(i > 3 for i in range(5)) and not all([1, 0])
assert list(range(10, 0, -3)) == [10, 7, 4, 1] and 7 in range(1, 10, 2) and range(5)[-1] == 4

# dicts, sets, text
d = {"r": 1.0, "h": 2}
d["n"] = 3
d.update({"h": 5})
assert list(d) == ["r", "h", "n"] and d.get("z", 0) == 0 and d["h"] == 5 and "r" in d and len(d) == 3
assert list(d.items())[0] == ("r", 1.0) and d.pop("n") == 3 and list(d.values()) == [1.0, 5]
assert {1, 2} | {3} == {1, 2, 3} and {1, 2} & {2} == {2} and 2 in {1, 2} and {(1, 2): 3}[(1, 2)] == 3
assert f"{3.14159:.2f} {7:03d} {'a':>3}|{1000000:,}" == "3.14 007   a|1,000,000"
assert f"piece{1}" == "piece1" and "a,b".split(",") == ["a", "b"] and "-".join(["x", "y"]) == "x-y"
assert "Ball".lower() == "ball" and "abc"[1:] == "bc" and "ab" * 2 == "abab" and "b" in "abc" and str(1.0) == "1.0"
print("nothing", 1, d)

# control flow
total = 0
for i in range(10):
    if i == 2:
        continue
    if i == 5:
        break
    total += i
else:
    total = -1
assert total == 8
while total > 0:
    total -= 3
else:
    total = 100
assert total == 100
n = 0
if n > 0:
    n = 1
elif n == 0:
    n = 2
else:
    n = 3
assert n == 2
try:
    1 / 0
except ZeroDivisionError as e:
    caught = str(e)
finally:
    done = True
assert caught == "division by zero" and done
try:
    [][0]
except (KeyError, IndexError):
    caught = "index"
assert caught == "index"
try:
    raise ValueError("bad radius")
except Exception as e:
    assert str(e) == "bad radius" or "bad radius" in str(e)
if (m := 5) > 3:
    n = m
assert n == 5


# functions
def shape(r, h=2.0, *more, scale=1.0, **named):
    """Volume of a cylinder."""
    return pi * r ** 2 * h * scale + sum(more) + len(named)


assert shape(1.0, 1.0) == pi and shape(1.0, h=1.0, scale=2.0) == 2 * pi and shape(0, 0, 1, 2, k=1) == 4
assert shape(*[1.0, 1.0], **{"scale": 3.0}) == 3 * pi


def outer(k):
    def inner(v: float) -> float:
        return v * k
    return inner


def fact(k):
    return 1 if k <= 1 else k * fact(k - 1)


assert outer(3)(4) == 12 and fact(10) == 3628800
counter = 0


def bump():
    global counter
    counter += 1


bump()
bump()
assert counter == 2
area = lambda r, k=2: k * r
assert area(3) == 6 and (lambda: 7)() == 7
r: float = 2.5
assert r == 2.5
if __name__ == "__main__":
    r = 3.0
assert r == 3.0
