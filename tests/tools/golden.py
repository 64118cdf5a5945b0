#!/usr/bin/env python3
"""Writes tests/data/golden.json: what CPython with numpy makes of every recorded answer.

    python3 tests/tools/golden.py [ANSWER.md ...] > tests/data/golden.json

Runs the code of each answer, step by step in one namespace, and notes for every cloud its shape, mean,
bounds, and a few points at full precision. Unseeded draws start from np.random.seed(0), as in donut.
"""
import json
import pathlib
import re
import sys

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2] / "prompts" / "recorded"


def clouds(text):
    namespace = {"np": np}
    np.random.seed(0)
    found = {}
    for part in re.split(r"^### ", text, flags=re.M)[1:]:
        step = re.match(r"Step (\d+)", part).group(1)
        for code in re.findall(r"```python\n(.*?)```", part, flags=re.S):
            exec(code, namespace)
        names = re.search(r"out var name: \[(.*?)\]", part).group(1)
        for name in re.findall(r"\w+", names):
            cloud = np.asarray(namespace[name], float)
            picked = [0, len(cloud) // 2, len(cloud) - 1]
            found[f"step{step}/{name}"] = {
                "shape": list(cloud.shape),
                "mean": cloud.mean(axis=0).tolist(),
                "min": cloud.min(axis=0).tolist(),
                "max": cloud.max(axis=0).tolist(),
                "points": {str(i): cloud[i].tolist() for i in picked},
            }
    return found


def main():
    files = [pathlib.Path(f) for f in sys.argv[1:]] or sorted(ROOT.glob("*/*.md"))
    golden = {f"{f.parent.name}/{f.name}": clouds(f.read_text()) for f in files}
    json.dump(golden, sys.stdout, indent=1)
    print()


main()
