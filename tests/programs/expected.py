"""Writes expected.json: `out` of every block of the programs here, by CPython and numpy."""
import glob, io, json, contextlib, math, os, re
import numpy as np

here = os.path.dirname(os.path.abspath(__file__))
table = {}
for path in sorted(glob.glob(os.path.join(here, "*.py"))):
    file = os.path.basename(path)[:-3]
    if file == "expected":
        continue
    for block in re.split(r"^#%% ", open(path).read(), flags=re.M)[1:]:
        name, code = block.split("\n", 1)
        space = {"np": np, "math": math, "__name__": "__main__"}
        with contextlib.redirect_stdout(io.StringIO()):
            exec(compile(code, f"{file}: {name}", "exec"), space)
        out = np.asarray(space["out"], dtype=float)
        assert out.size <= 400 and np.isfinite(out).all(), (file, name, out)
        table[f"{file}: {name}"] = {"shape": list(out.shape), "values": out.ravel().tolist()}
with open(os.path.join(here, "expected.json"), "w") as f:
    f.write("{\n" + ",\n".join(f"{json.dumps(k)}: {json.dumps(v)}" for k, v in table.items()) + "\n}\n")
print(len(table), "programs, numpy", np.__version__)
