// Vectors are arrays of three, matrices are column-major arrays of sixteen.

const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const add = (a, b, s = 1) => [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = (a) => { const n = Math.hypot(...a) || 1; return a.map((v) => v / n); };

function multiply(a, b) {
  const out = new Array(16).fill(0);
  for (let c = 0; c < 4; c++) for (let r = 0; r < 4; r++) for (let k = 0; k < 4; k++) {
    out[4 * c + r] += a[4 * k + r] * b[4 * c + k];
  }
  return out;
}

function perspective(tangent, aspect, near, far) {
  const f = 1 / tangent;
  return [f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) / (near - far), -1, 0, 0, 2 * far * near / (near - far), 0];
}

function lookAt(eye, at) {
  const back = unit(sub(eye, at)), right = unit(cross([0, 1, 0], back)), up = cross(back, right);
  return [right[0], up[0], back[0], 0, right[1], up[1], back[1], 0, right[2], up[2], back[2], 0,
    -dot(right, eye), -dot(up, eye), -dot(back, eye), 1];
}

// A rigid motion: quaternion (w, x, y, z), then a translation.
function rigid([w, x, y, z], t) {
  const n = Math.hypot(w, x, y, z) || 1;
  [w, x, y, z] = [w / n, x / n, y / n, z / n];
  return [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y), 0,
    2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x), 0,
    2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y), 0, t[0], t[1], t[2], 1];
}

// Squared distances, in cells, to the nearest set cell of a grid n x n x n (Felzenszwalb and Huttenlocher).
function squaredDistances(grid, n) {
  const line = new Float64Array(n), from = new Int32Array(n), edges = new Float64Array(n + 1);
  const strides = [1, n, n * n];
  for (let axis = 0; axis < 3; axis++) {
    const s = strides[axis], u = strides[(axis + 1) % 3], v = strides[(axis + 2) % 3];
    for (let a = 0; a < n; a++) for (let b = 0; b < n; b++) {
      const base = a * u + b * v;
      for (let i = 0; i < n; i++) line[i] = grid[base + i * s];
      let k = 0;
      from[0] = 0; edges[0] = -Infinity; edges[1] = Infinity;
      const meet = (i, j) => (line[i] + i * i - line[j] - j * j) / (2 * (i - j));
      for (let i = 1; i < n; i++) {
        let at = meet(i, from[k]);
        while (at <= edges[k]) { k--; at = meet(i, from[k]); }
        k++; from[k] = i; edges[k] = at; edges[k + 1] = Infinity;
      }
      for (let i = 0, j = 0; i < n; i++) {
        while (edges[j + 1] < i) j++;
        grid[base + i * s] = (i - from[j]) ** 2 + line[from[j]];
      }
    }
  }
  return grid;
}
