"""Times donut's earth mover's distance beside POT's and GeomLoss's in one run, and prints the ratios.

    pip install numpy pot                  # exact
    pip install torch geomloss             # Sinkhorn divergence; left out if torch cannot be imported
    cargo build --release
    python benches/compare_emd.py [--donut target/release/donut] [--threads 2] [--points 1000 5000]

The clouds are a ball and a ring. donut's seconds are those that `donut emd --json` reports: without
reading files. All are the best of some runs; values are printed so that one sees that the same was computed.
"""

import argparse
import json
import os
import subprocess
import tempfile
import time
from pathlib import Path

REPETITIONS = 5


def parse():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--donut", default="target/release/donut")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--points", type=int, nargs="+", default=[1000, 5000])
    return parser.parse_args()


def clouds(np, n):
    rng = np.random.default_rng(0)
    d = rng.normal(size=(n, 3))
    ball = 0.5 + 0.12 * rng.random((n, 1)) ** (1 / 3) * d / np.linalg.norm(d, axis=1, keepdims=True)
    around, across = 2 * np.pi * rng.random((2, n))
    r = 0.05 * np.sqrt(rng.random(n))
    out = 0.15 + r * np.cos(across)
    ring = 0.5 + np.stack([out * np.cos(around), r * np.sin(across), out * np.sin(around)], axis=1)
    return ball, ring


def best_of(work):
    seconds, value = float("inf"), None
    for _ in range(REPETITIONS):
        begin = time.perf_counter()
        value = work()
        seconds = min(seconds, time.perf_counter() - begin)
    return seconds, value


def donut(program, threads, files, *flags):
    environment = dict(os.environ, RAYON_NUM_THREADS=str(threads))
    command = [program, "emd", *files, "--json", *flags]
    runs = [json.loads(subprocess.check_output(command, env=environment)) for _ in range(REPETITIONS)]
    return min(run["seconds"] for run in runs), runs[0]["value"]


def report(what, n, ours, theirs, name):
    print(f"{what:<10} {n:>5} points: donut {1e3 * ours[0]:9.2f} ms ({ours[1]:.6f}), "
          f"{name} {1e3 * theirs[0]:9.2f} ms ({theirs[1]:.6f}), ratio {theirs[0] / ours[0]:6.1f}", flush=True)


def main():
    args = parse()
    # Before NumPy and torch are loaded: they read these once.
    os.environ["OMP_NUM_THREADS"] = os.environ["OPENBLAS_NUM_THREADS"] = str(args.threads)
    import numpy as np
    import ot

    try:
        import torch
        from geomloss import SamplesLoss
    except (ImportError, OSError, ValueError) as error:
        torch = None
        print(f"no GeomLoss: torch cannot be imported ({str(error)[:80]})")

    with tempfile.TemporaryDirectory() as folder:
        for n in args.points:
            x, y = clouds(np, n)
            files = [str(Path(folder) / name) for name in ("x.npy", "y.npy")]
            for file, cloud in zip(files, (x, y)):
                np.save(file, cloud)
            gradient = str(Path(folder) / "gradient.npy")

            def exact():
                return ot.emd2([], [], ot.dist(x, y, metric="euclidean"), numItermax=10_000_000)

            match = str(Path(folder) / "match.npy")
            ours = donut(args.donut, args.threads, files, "--exact", "--match", match)
            report("exact", n, ours, best_of(exact), "POT")
            ours = donut(args.donut, args.threads, files, "--precision", "f32", "--gradient", gradient)
            if torch is None:
                print(f"sinkhorn   {n:>5} points: donut {1e3 * ours[0]:9.2f} ms ({ours[1]:.6f})", flush=True)
                continue
            torch.set_num_threads(args.threads)
            loss = SamplesLoss("sinkhorn", p=1, blur=0.001, scaling=0.5, backend="tensorized")
            u = torch.tensor(x, dtype=torch.float32, requires_grad=True)
            v = torch.tensor(y, dtype=torch.float32)

            def sinkhorn():
                value = loss(u, v)
                torch.autograd.grad(value, u)
                return float(value.detach())

            report("sinkhorn", n, ours, best_of(sinkhorn), "GeomLoss")


if __name__ == "__main__":
    main()
