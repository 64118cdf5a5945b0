// The dough as one body: particle depths are drawn aside, smoothed across the body but not over its
// edges, and shaded from the smooth depths. Where float targets are missing, particles are shown instead.

const DEPTHS = {
  // What `SHADERS.dough` draws, but depth and colour instead of light.
  splat: [SHADERS.dough[0], `#version 300 es
    precision highp float;
    uniform mat4 projection;
    uniform float radius;
    in vec3 center, tint;
    in float open;
    out vec4 color;
    void main() {
      vec2 d = gl_PointCoord * 2.0 - 1.0;
      float r2 = dot(d, d);
      if (r2 > 1.0) discard;
      float away = -center.z - radius * sqrt(1.0 - r2);
      vec4 clip = projection * vec4(center.xy, -away, 1.0);
      gl_FragDepth = 0.5 * clip.z / clip.w + 0.5;
      color = vec4(tint * open, away);
    }`],

  smooth: [`#version 300 es
    layout(location = 0) in vec2 corner;
    void main() { gl_Position = vec4(corner, 0.0, 1.0); }`, `#version 300 es
    precision highp float;
    uniform highp sampler2D seen;
    uniform float radius, pixels, reach;
    out vec4 color;
    void main() {
      ivec2 at = ivec2(gl_FragCoord.xy), most = textureSize(seen, 0) - 1;
      vec4 here = texelFetch(seen, at, 0);
      color = here;
      if (here.a <= 0.0) return;
      float size = reach * radius * pixels / here.a, weights = 0.0;
      vec4 sum = vec4(0.0);
      for (int i = -3; i <= 3; i++) for (int j = -3; j <= 3; j++) {
        vec2 off = vec2(i, j) / 3.0;
        vec4 there = texelFetch(seen, clamp(at + ivec2(round(off * size)), ivec2(0), most), 0);
        float jump = (there.a - here.a) / (2.5 * radius);
        float weight = there.a > 0.0 ? exp(-2.0 * dot(off, off) - jump * jump) : 0.0;
        sum += weight * there;
        weights += weight;
      }
      color = sum / weights;
    }`],

  compose: [`#version 300 es
    layout(location = 0) in vec2 corner;
    void main() { gl_Position = vec4(corner, 0.0, 1.0); }`, `#version 300 es
    precision highp float;
    uniform highp sampler2D seen;
    uniform mat4 view, projection;
    uniform float radius;
    out vec4 color;
    ${LIGHT}
    vec2 most;
    vec4 look(vec2 at) { return texelFetch(seen, ivec2(clamp(at, vec2(0.0), most)), 0); }
    vec3 place(vec2 at, float away) {
      vec2 ndc = at / (most + 1.0) * 2.0 - 1.0;
      return vec3(ndc.x * away / projection[0][0], ndc.y * away / projection[1][1], -away);
    }
    // The slope along a direction, from the side that belongs to the same body.
    vec3 slope(vec2 at, vec2 step, float away, vec3 here) {
      float a = look(at - step).a, b = look(at + step).a;
      bool useA = a > 0.0 && abs(a - away) < radius, useB = b > 0.0 && abs(b - away) < radius;
      vec3 from = useA ? place(at - step, a) : here, to = useB ? place(at + step, b) : here;
      return useA || useB ? to - from : vec3(step, 0.0) * 1e-3;
    }
    void main() {
      vec2 at = gl_FragCoord.xy;
      most = vec2(textureSize(seen, 0)) - 1.0;
      vec4 texel = look(at);
      if (texel.a <= 0.0) discard;
      vec3 here = place(at, texel.a);
      vec3 n = normalize(cross(slope(at, vec2(1.0, 0.0), texel.a, here), slope(at, vec2(0.0, 1.0), texel.a, here)));
      // Darker where the surroundings stand higher.
      float closed = 0.0;
      for (int k = 0; k < 16; k++) {
        float turn = float(k) * 2.39996, reach = 7.0 * radius * sqrt((float(k) + 0.5) / 16.0);
        vec2 to = at + vec2(cos(turn), sin(turn)) * reach * projection[1][1] * 0.5 * (most.y + 1.0) / texel.a;
        float away = look(to).a;
        vec3 rise = place(to, away) - here;
        if (away > 0.0 && length(rise) < 12.0 * radius) closed += max(dot(normalize(rise), n) - 0.1, 0.0);
      }
      vec4 clip = projection * vec4(here, 1.0);
      gl_FragDepth = 0.5 * clip.z / clip.w + 0.5;
      mat3 back = transpose(mat3(view));
      color = vec4(lit(texel.rgb, back * n, back * normalize(-here), 0.35, 0.06, 1.0 - closed / 9.0), 1.0);
    }`],
};

// How far each round of smoothing looks, in radii of a particle: the later ones hide the earlier ones' grain.
const REACHES = [1.6, 1.1, 0.6, 0.25];

class Body {
  constructor(viewer) {
    this.viewer = viewer;
    this.available = Boolean(viewer.gl.getExtension("EXT_color_buffer_float"));
    if (!this.available) return;
    for (const [name, sources] of Object.entries(DEPTHS)) viewer.programs[name] = viewer.program(...sources);
  }

  // Two float pictures of the canvas's size, drawn into in turns, and a depth buffer.
  resize(width, height) {
    if (this.width === width && this.height === height) return;
    const gl = this.viewer.gl;
    if (this.targets) {
      gl.deleteRenderbuffer(this.depth);
      for (const t of this.targets) { gl.deleteTexture(t.texture); gl.deleteFramebuffer(t.frame); }
    }
    Object.assign(this, {width, height, depth: gl.createRenderbuffer()});
    gl.bindRenderbuffer(gl.RENDERBUFFER, this.depth);
    gl.renderbufferStorage(gl.RENDERBUFFER, gl.DEPTH_COMPONENT24, width, height);
    gl.activeTexture(gl.TEXTURE2);
    this.targets = [0, 1].map(() => {
      const texture = gl.createTexture(), frame = gl.createFramebuffer();
      gl.bindTexture(gl.TEXTURE_2D, texture);
      gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA32F, width, height);
      for (const f of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, f, gl.NEAREST);
      gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
      gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
      gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.RENDERBUFFER, this.depth);
      return {texture, frame};
    });
  }

  // `uniforms` are those of the dough's particles.
  draw(width, height, uniforms) {
    const {viewer} = this, {gl, run} = viewer, radius = 1.3 * run.spacing;
    this.resize(width, height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.targets[0].frame);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    viewer.use("splat", {...uniforms, radius});
    gl.bindVertexArray(viewer.dough);
    gl.drawArrays(gl.POINTS, 0, run.particles);
    gl.disable(gl.DEPTH_TEST);
    gl.bindVertexArray(viewer.plane);
    gl.activeTexture(gl.TEXTURE2);
    for (const [pass, reach] of REACHES.entries()) {
      gl.bindFramebuffer(gl.FRAMEBUFFER, this.targets[1 - pass % 2].frame);
      gl.bindTexture(gl.TEXTURE_2D, this.targets[pass % 2].texture);
      viewer.use("smooth", {seen: 2, radius, reach});
      gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
    }
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.bindTexture(gl.TEXTURE_2D, this.targets[REACHES.length % 2].texture);
    gl.enable(gl.DEPTH_TEST);
    viewer.use("compose", {seen: 2, radius});
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
  }
}
