// The three-dimensional view: WebGL 2, drawn only when something changed.

const HALF_VIEW = 0.26;
const OVERLAYS = {target: [0.10, 0.62, 0.34, 0.5], subgoal: [0.13, 0.42, 0.86, 0.5], initial: [0.5, 0.5, 0.55, 0.4],
  reachable: [0.72, 0.16, 0.42, 0.75]};

class Viewer {
  // `run` is the report's data; `frames`, `clouds` and `aims` are arrays of Uint16Array (all x, all y, all z).
  constructor(canvas, run, {frames, clouds, aims}) {
    const gl = canvas.getContext("webgl2", {antialias: true, alpha: false});
    if (!gl) throw new Error("this browser has no WebGL 2, so the run cannot be shown in three dimensions");
    Object.assign(this, {canvas, gl, run, frames, clouds, aims, frame: 0, mode: 0, style: "body", shown: {tool: true}, detail: 1});
    this.programs = Object.fromEntries(Object.entries(SHADERS).map(([k, s]) => [k, this.program(...s)]));
    this.body = new Body(this);
    this.upload();
    this.buildDistances();
    this.buildShadow();
    this.home();
    this.listen();
    // At once: waiting for the next frame would show a stretched picture.
    new ResizeObserver(() => this.draw()).observe(canvas);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.invalidate());
  }

  program(vertex, fragment) {
    const gl = this.gl, program = gl.createProgram();
    for (const [type, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(type);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
    const uniforms = {};
    for (let i = 0; i < gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS); i++) {
      const {name, type} = gl.getActiveUniform(program, i);
      uniforms[name] = [gl.getUniformLocation(program, name), type];
    }
    return {program, uniforms};
  }

  use(name, values) {
    const gl = this.gl, {program, uniforms} = this.programs[name];
    gl.useProgram(program);
    for (const [key, value] of Object.entries({...this.common, ...values})) {
      if (!uniforms[key]) continue;
      const [at, type] = uniforms[key];
      if (type === gl.FLOAT_MAT4) gl.uniformMatrix4fv(at, false, value);
      else if (type === gl.FLOAT_VEC4) gl.uniform4fv(at, value);
      else if (type === gl.FLOAT_VEC3) gl.uniform3fv(at, value);
      else if (type === gl.FLOAT) gl.uniform1f(at, value);
      else gl.uniform1i(at, value);
    }
  }

  buffer(data, usage = this.gl.STATIC_DRAW) {
    const gl = this.gl, buffer = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, data, usage);
    return buffer;
  }

  // Attributes first, first + 1, first + 2: the three axes of a cloud as fractions of the box; `every` and `from` pick
  // points.
  axes(buffer, count, first = 0, every = 1, from = 0) {
    const gl = this.gl;
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    for (let a = 0; a < 3; a++) {
      gl.enableVertexAttribArray(first + a);
      gl.vertexAttribPointer(first + a, 1, gl.UNSIGNED_SHORT, true, 2 * every, 2 * (a * count + from));
    }
  }

  array(setup) {
    const gl = this.gl, array = gl.createVertexArray();
    gl.bindVertexArray(array);
    setup();
    gl.bindVertexArray(null);
    return array;
  }

  upload() {
    const gl = this.gl, run = this.run, n = run.particles;
    this.now = this.buffer(this.frames[0], gl.DYNAMIC_DRAW);
    this.before = this.buffer(this.frames[0], gl.DYNAMIC_DRAW);
    const piece = this.buffer(Uint8Array.from(run.piece, (p) => ((p % 6) + 6) % 6));
    this.dough = this.array(() => {
      this.axes(this.now, n, 0);
      this.axes(this.before, n, 3);
      gl.bindBuffer(gl.ARRAY_BUFFER, piece);
      gl.enableVertexAttribArray(6);
      gl.vertexAttribPointer(6, 1, gl.UNSIGNED_BYTE, false, 0, 0);
    });
    const dots = (cloud) => {
      const buffer = this.buffer(cloud), count = cloud.length / 3;
      return {count, array: this.array(() => this.axes(buffer, count))};
    };
    this.dots = this.clouds.map(dots);
    this.initial = dots(this.frames[0]);
    // Pairs of points: a particle, and where it should go.
    const pairs = 2 * run.reachable.count;
    this.pairs = new Uint16Array(3 * pairs);
    this.pairsBuffer = this.buffer(this.pairs, gl.DYNAMIC_DRAW);
    this.ways = this.array(() => this.axes(this.pairsBuffer, pairs));
    this.ends = this.array(() => this.axes(this.pairsBuffer, pairs, 0, 2, 1));
    const corners = this.buffer(new Float32Array([-1, -1, 1, -1, -1, 1, 1, 1]));
    this.plane = this.array(() => {
      gl.bindBuffer(gl.ARRAY_BUFFER, corners);
      gl.enableVertexAttribArray(0);
      gl.vertexAttribPointer(0, 2, gl.FLOAT, false, 0, 0);
    });
    this.tools = run.tools.map((tool) => {
      const vertices = [this.buffer(new Float32Array(tool.positions)), this.buffer(new Float32Array(tool.normals))];
      const indices = gl.createBuffer();
      const array = this.array(() => {
        vertices.forEach((buffer, at) => {
          gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
          gl.enableVertexAttribArray(at);
          gl.vertexAttribPointer(at, 3, gl.FLOAT, false, 0, 0);
        });
        gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, indices);
        gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, new Uint32Array(tool.triangles), gl.STATIC_DRAW);
      });
      return {array, count: tool.triangles.length};
    });
  }

  // A grid of distances to the target, for colouring particles by how far off they are.
  buildDistances() {
    const gl = this.gl, {low, size} = this.run, cloud = this.clouds[0], n = 64;
    const edge = 1.1 * Math.max(...size), corner = low.map((l, a) => l + 0.5 * size[a] - 0.5 * edge);
    const grid = new Float64Array(n ** 3).fill(1e9), count = cloud.length / 3;
    for (let i = 0; i < count; i++) {
      const [x, y, z] = [0, 1, 2].map((a) => {
        const p = low[a] + size[a] * cloud[a * count + i] / 65535;
        return Math.min(n - 1, Math.max(0, Math.floor((p - corner[a]) / edge * n)));
      });
      grid[(z * n + y) * n + x] = 0;
    }
    this.reach = 0.25 * Math.max(...size);
    const shades = Uint8Array.from(squaredDistances(grid, n),
      (d) => Math.min(255, 255 * Math.max(0, Math.sqrt(d) - 0.5) * edge / n / this.reach));
    this.distances = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_3D, this.distances);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    gl.texImage3D(gl.TEXTURE_3D, 0, gl.R8, n, n, n, 0, gl.RED, gl.UNSIGNED_BYTE, shades);
    for (const f of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_3D, f, gl.LINEAR);
    for (const w of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T, gl.TEXTURE_WRAP_R]) gl.texParameteri(gl.TEXTURE_3D, w, gl.CLAMP_TO_EDGE);
    this.targetBox = {targetLow: corner, targetSize: edge};
  }

  buildShadow() {
    const gl = this.gl;
    this.shadow = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, this.shadow);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.R8, 512, 512, 0, gl.RED, gl.UNSIGNED_BYTE, null);
    for (const f of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, f, gl.LINEAR);
    for (const w of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, w, gl.CLAMP_TO_EDGE);
    this.shadowTarget = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.shadowTarget);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, this.shadow, 0);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  }

  home() {
    const {low, size, table} = this.run;
    this.at = low.map((l, a) => l + 0.5 * size[a]);
    this.at[1] = table + 0.25 * (low[1] + size[1] - table);
    Object.assign(this, {yaw: 0.42, pitch: 0.52, away: 0.5 * Math.hypot(...size) / HALF_VIEW});
    this.invalidate();
  }

  listen() {
    const canvas = this.canvas, pointers = new Map();
    canvas.addEventListener("pointerdown", (e) => {
      canvas.setPointerCapture(e.pointerId);
      pointers.set(e.pointerId, [e.clientX, e.clientY]);
    });
    const drop = (e) => pointers.delete(e.pointerId);
    canvas.addEventListener("pointerup", drop);
    canvas.addEventListener("pointercancel", drop);
    canvas.addEventListener("contextmenu", (e) => e.preventDefault());
    canvas.addEventListener("pointermove", (e) => {
      const last = pointers.get(e.pointerId);
      if (!last) return;
      const [dx, dy] = [e.clientX - last[0], e.clientY - last[1]];
      const spread = () => { const [a, b] = [...pointers.values()]; return Math.hypot(a[0] - b[0], a[1] - b[1]); };
      const apart = pointers.size === 2 ? spread() : 0;
      pointers.set(e.pointerId, [e.clientX, e.clientY]);
      if (pointers.size === 2) {
        this.pan(dx / 2, dy / 2);
        this.zoom(apart / Math.max(spread(), 1));
      } else if (e.shiftKey || e.buttons & 6) {
        this.pan(dx, dy);
      } else {
        this.orbit(-dx * 0.008, dy * 0.008);
      }
    });
    canvas.addEventListener("wheel", (e) => {
      e.preventDefault();
      this.zoom(Math.exp(e.deltaY * (e.deltaMode ? 0.03 : 0.001)));
    }, {passive: false});
  }

  orbit(yaw, pitch) {
    this.yaw += yaw;
    this.pitch = Math.min(1.55, Math.max(0.02, this.pitch + pitch));
    this.invalidate();
  }

  zoom(factor) {
    this.away = Math.min(20, Math.max(0.05, this.away * factor));
    this.invalidate();
  }

  pan(dx, dy) {
    const scale = 2 * this.tangent * this.away / this.canvas.clientHeight, [right, up] = this.screen();
    this.at = add(add(this.at, right, -dx * scale), up, dy * scale);
    this.invalidate();
  }

  towardsEye() {
    return [Math.sin(this.yaw) * Math.cos(this.pitch), Math.sin(this.pitch), Math.cos(this.yaw) * Math.cos(this.pitch)];
  }

  screen() {
    const back = this.towardsEye(), right = unit(cross([0, 1, 0], back));
    return [right, cross(back, right)];
  }

  // Shows a frame; displacements are counted from frame `since`.
  show(frame, since) {
    const gl = this.gl;
    gl.bindBuffer(gl.ARRAY_BUFFER, this.now);
    gl.bufferSubData(gl.ARRAY_BUFFER, 0, this.frames[frame]);
    if (since !== this.since) {
      gl.bindBuffer(gl.ARRAY_BUFFER, this.before);
      gl.bufferSubData(gl.ARRAY_BUFFER, 0, this.frames[since]);
      this.since = since;
    }
    this.frame = frame;
    this.invalidate();
  }

  invalidate() {
    if (this.pending) return;
    this.pending = requestAnimationFrame(() => { this.pending = 0; this.draw(); });
  }

  // The bodies of the tool in use, as motions.
  bodies() {
    const {tool, pose, tools} = this.run, index = tool[this.frame];
    if (index < 0 || !this.shown.tool) return [];
    const [x, y, z, ...rest] = pose.slice(8 * this.frame, 8 * this.frame + 8), q = rest.slice(0, 4), gap = rest[4];
    const turn = rigid(q, [x, y, z]);
    const at = (s) => rigid(q, add([x, y, z], turn.slice(0, 3), s));
    return (tools[index].gripper ? [at(-gap / 2), at(gap / 2)] : [turn]).map((model) => ({index, model}));
  }

  draw() {
    const {gl, canvas, run} = this, ratio = Math.min(devicePixelRatio || 1, 2) * this.detail;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight].map((v) => Math.max(1, Math.round(v * ratio)));
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, {width, height});
    // On a narrow canvas the width has to hold what the height holds otherwise.
    this.tangent = HALF_VIEW / Math.min(1, width / height);
    const eye = add(this.at, this.towardsEye(), this.away);
    const {low, size, table} = run, middle = low.map((l, a) => l + 0.5 * size[a]);
    const dark = matchMedia("(prefers-color-scheme: dark)").matches;
    this.common = {
      low, size, table, middle, eye,
      view: lookAt(eye, this.at),
      projection: perspective(this.tangent, width / height, this.away * 0.05, this.away + 8),
      pixels: 0.5 * height / this.tangent,
      radius: 1.0 * run.spacing,
      extent: 1.6, shadowExtent: Math.max(0.5, 0.9 * Math.max(size[0], size[2])),
      top: dark ? [0.25, 0.27, 0.31] : [0.80, 0.815, 0.83], backdrop: dark ? [0.085, 0.095, 0.115] : [0.935, 0.94, 0.945],
    };
    this.drawShadow();
    gl.viewport(0, 0, width, height);
    gl.clearColor(...this.common.backdrop, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.disable(gl.BLEND);
    this.drawTable();
    this.drawDough();
    this.drawTools();
    this.drawOverlays();
    gl.bindVertexArray(null);
  }

  drawShadow() {
    const {gl, run} = this;
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.shadowTarget);
    gl.viewport(0, 0, 512, 512);
    gl.clearColor(0, 0, 0, 1);
    gl.clear(gl.COLOR_BUFFER_BIT);
    gl.disable(gl.DEPTH_TEST);
    this.use("shadow", {radius: 2 * run.spacing});
    gl.bindVertexArray(this.dough);
    gl.drawArrays(gl.POINTS, 0, run.particles);
    for (const {index, model} of this.bodies()) {
      this.use("shadowMesh", {model});
      gl.bindVertexArray(this.tools[index].array);
      gl.drawElements(gl.TRIANGLES, this.tools[index].count, gl.UNSIGNED_INT, 0);
    }
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  }

  drawTable() {
    const gl = this.gl;
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, this.shadow);
    this.use("table", {shadow: 0});
    gl.bindVertexArray(this.plane);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
  }

  drawDough() {
    const {gl, run} = this;
    gl.activeTexture(gl.TEXTURE1);
    gl.bindTexture(gl.TEXTURE_3D, this.distances);
    const height = run.low[1] + run.size[1] - run.table;
    // The texture holds distances as fractions of the reach.
    const uniforms = {...this.targetBox, targetDistance: 1, mode: this.mode, height, reach: this.mode === 3 ? 1 : this.reach};
    if (this.style === "body" && this.body.available) return this.body.draw(this.canvas.width, this.canvas.height, uniforms);
    this.use("dough", uniforms);
    gl.bindVertexArray(this.dough);
    gl.drawArrays(gl.POINTS, 0, run.particles);
  }

  // Metal is see-through: a gripper's plates would hide what they hold.
  drawTools() {
    const {gl, run} = this;
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    for (const {index, model} of this.bodies()) {
      const look = run.tools[index].wooden
        ? {tint: [0.5, 0.26, 0.11], shine: 0.12, opacity: 1}
        : {tint: [0.4, 0.43, 0.47], shine: 0.5, opacity: 0.6};
      this.use("mesh", {model, ...look});
      gl.bindVertexArray(this.tools[index].array);
      gl.drawElements(gl.TRIANGLES, this.tools[index].count, gl.UNSIGNED_INT, 0);
    }
  }

  drawOverlays() {
    const {gl, run} = this, chosen = [];
    if (this.shown.initial) chosen.push(["initial", this.initial]);
    if (this.shown.target) chosen.push(["target", this.dots[0]]);
    const subgoal = this.dots[1 + run.stage[this.frame]];
    if (this.shown.subgoal && subgoal) chosen.push(["subgoal", subgoal]);
    gl.depthMask(false);
    gl.disable(gl.DEPTH_TEST);
    for (const [name, cloud] of chosen) {
      this.use("dots", {radius: 0.35 * run.spacing, tint: OVERLAYS[name]});
      gl.bindVertexArray(cloud.array);
      gl.drawArrays(gl.POINTS, 0, cloud.count);
    }
    if (this.shown.reachable) this.drawWays();
    gl.depthMask(true);
  }

  // Lines from particles to where the segment of this frame wants them, with dots at their ends.
  drawWays() {
    const {gl, run, frame} = this, {count, every} = run.reachable, aim = this.aims[run.reachable.frames.findLastIndex((f) => f <= frame)];
    if (!aim) return;
    const now = this.frames[frame];
    for (let a = 0; a < 3; a++) for (let j = 0; j < count; j++) {
      this.pairs[2 * (a * count + j)] = now[a * run.particles + j * every];
      this.pairs[2 * (a * count + j) + 1] = aim[a * count + j];
    }
    gl.bindBuffer(gl.ARRAY_BUFFER, this.pairsBuffer);
    gl.bufferSubData(gl.ARRAY_BUFFER, 0, this.pairs);
    this.use("ways", {tint: OVERLAYS.reachable});
    gl.bindVertexArray(this.ways);
    gl.drawArrays(gl.LINES, 0, 2 * count);
    this.use("dots", {radius: 0.3 * run.spacing, tint: OVERLAYS.reachable});
    gl.bindVertexArray(this.ends);
    gl.drawArrays(gl.POINTS, 0, count);
  }
}
