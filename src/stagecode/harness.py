"""Runs the code of an answer inside the sandbox: requests come in as lines of JSON, replies go out.

A reply is one line of JSON; where it has "bytes", that many bytes of a .npy file follow.
"""
import io
import json
import math
import os
import resource
import sys

limits = json.loads(sys.argv[1])
requests = os.fdopen(os.dup(0), "rb")
replies = os.fdopen(os.dup(1), "wb")
nowhere = os.open(os.devnull, os.O_RDWR)
for stream in (0, 1, 2):
    os.dup2(nowhere, stream)


def reply(message, payload=b""):
    replies.write(json.dumps(message).encode() + b"\n" + payload)
    replies.flush()


try:
    import numpy as np
except Exception as error:
    reply({"missing": str(error)})
    sys.exit(1)

for name, most in (
    ("RLIMIT_AS", limits["memory_bytes"]),
    ("RLIMIT_CPU", limits["cpu_seconds"]),
    ("RLIMIT_FSIZE", 0),
    ("RLIMIT_CORE", 0),
    ("RLIMIT_NPROC", 0),
):
    resource.setrlimit(getattr(resource, name), (most, most))
reply({"ready": np.__version__})

space = {"__name__": "__main__", "np": np, "numpy": np, "math": math}
first_lines = {}


def place(error):
    """Line and column of the innermost place in the answer."""
    if isinstance(error, SyntaxError) and error.filename in first_lines:
        return first_lines[error.filename] + (error.lineno or 1) - 1, error.offset or 1
    found = (0, 1)
    trace = error.__traceback__
    while trace is not None:
        code = trace.tb_frame.f_code
        if code.co_filename in first_lines:
            column = 0
            if hasattr(code, "co_positions"):
                column = list(code.co_positions())[trace.tb_lasti // 2][2] or 0
            found = (first_lines[code.co_filename] + trace.tb_lineno - 1, column + 1)
        trace = trace.tb_next
    return found


def run(request):
    label = "answer, line %d" % request["first_line"]
    first_lines[label] = request["first_line"]
    try:
        exec(compile(request["code"], label, "exec"), space)
        return {"done": True}
    except BaseException as error:
        line, column = place(error)
        text = error.msg if isinstance(error, SyntaxError) else str(error)
        kind = "SyntaxError" if isinstance(error, SyntaxError) else type(error).__name__
        return {"exception": kind, "message": text[:2000], "line": line, "column": column}


def formula(request):
    try:
        value = eval(compile(request["text"], "formula", "eval"), dict(space, pi=math.pi))
        return {"value": float(value)}
    except Exception:
        return {"value": None}


def is_cloud(value):
    return isinstance(value, np.ndarray) and value.ndim == 2 and value.shape[1] == 3 and value.dtype.kind in "iuf"


def cloud_of(points):
    """The array of a list of points; the list itself where it is none."""
    try:
        array = np.asarray(points)
    except Exception:
        return points
    return array if is_cloud(array) else points


def capture(request):
    if request["name"] not in space:
        return {"kind": "missing"}, b""
    value = space[request["name"]]
    if isinstance(value, (int, float, np.number)) and not isinstance(value, (bool, complex)):
        value = np.asarray(float(value))
    if isinstance(value, (list, tuple)):
        value = cloud_of(value)
    if not isinstance(value, np.ndarray) or value.dtype.kind not in "iuf":
        return {"kind": "other", "type": type(value).__name__}, b""
    if value.size > limits["elements"]:
        return {"kind": "other", "type": "array of more than %d elements" % limits["elements"]}, b""
    file = io.BytesIO()
    np.lib.format.write_array(file, np.ascontiguousarray(value, dtype="<f8").reshape(value.shape), (1, 0), False)
    payload = file.getvalue()
    return {"kind": "array", "bytes": len(payload)}, payload


for line in requests:
    request = json.loads(line)
    if request["do"] == "run":
        reply(run(request))
    elif request["do"] == "formula":
        reply(formula(request))
    elif request["do"] == "capture":
        reply(*capture(request))
    else:
        names = [name for name, value in list(space.items()) if isinstance(name, str) and is_cloud(value)]
        reply({"names": sorted(names)})
