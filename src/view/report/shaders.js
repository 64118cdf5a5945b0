// Shading shared by all surfaces: a lamp, the sky, a highlight, and the shadow map on the table.
const LIGHT = `
  const vec3 LAMP = vec3(-0.461, 0.838, 0.293);
  vec3 lit(vec3 color, vec3 n, vec3 toEye, float wrap, float shine, float open) {
    float diffuse = max((dot(n, LAMP) + wrap) / (1.0 + wrap), 0.0);
    float gloss = shine * pow(max(dot(n, normalize(LAMP + toEye)), 0.0), 28.0);
    vec3 light = color * (0.95 * diffuse + open * (0.32 + 0.14 * n.y)) + gloss;
    return pow(min(light, vec3(1.0)), vec3(1.0 / 2.2));
  }`;

const SHADERS = {
  // Particles as shaded balls. A point sprite covers the ball; its depth is the ball's.
  dough: [`#version 300 es
    precision highp float;
    layout(location = 0) in float x;
    layout(location = 1) in float y;
    layout(location = 2) in float z;
    layout(location = 3) in float x0;
    layout(location = 4) in float y0;
    layout(location = 5) in float z0;
    layout(location = 6) in float piece;
    uniform mat4 view, projection;
    uniform vec3 low, size, targetLow;
    uniform float radius, pixels, table, height, reach, targetSize;
    uniform int mode;
    uniform highp sampler3D targetDistance;
    out vec3 center, tint;
    out float open;
    vec3 scale(float t) {  // dark violet, blue, green, yellow
      t = clamp(t, 0.0, 1.0) * 4.0;
      vec3 c[5] = vec3[](vec3(.05,.03,.20), vec3(.03,.16,.27), vec3(.04,.35,.21), vec3(.38,.62,.07), vec3(.96,.77,.04));
      int i = int(min(t, 3.999));
      return mix(c[i], c[i + 1], t - float(i));
    }
    void main() {
      vec3 p = low + size * vec3(x, y, z);
      vec3 p0 = low + size * vec3(x0, y0, z0);
      vec3 pieces[6] = vec3[](vec3(.77,.56,.31), vec3(.68,.35,.18), vec3(.35,.52,.32), vec3(.36,.43,.66), vec3(.66,.34,.48), vec3(.52,.50,.48));
      tint = pieces[int(piece) % 6];
      if (mode == 1) tint = scale(distance(p, p0) / reach);
      if (mode == 2) tint = scale((p.y - table) / height);
      if (mode == 3) tint = scale(texture(targetDistance, (p - targetLow) / targetSize).r / reach);
      open = 0.55 + 0.45 * clamp((p.y - table) / (6.0 * radius), 0.0, 1.0);
      vec4 seen = view * vec4(p, 1.0);
      center = seen.xyz;
      gl_Position = projection * seen;
      gl_PointSize = 2.0 * radius * pixels / -seen.z;
    }`, `#version 300 es
    precision highp float;
    uniform mat4 view, projection;
    uniform float radius;
    in vec3 center, tint;
    in float open;
    out vec4 color;
    ${LIGHT}
    void main() {
      vec2 d = gl_PointCoord * 2.0 - 1.0;
      float r2 = dot(d, d);
      if (r2 > 1.0) discard;
      vec3 n = vec3(d.x, -d.y, sqrt(1.0 - r2));
      vec3 p = center + radius * n;
      vec4 clip = projection * vec4(p, 1.0);
      gl_FragDepth = 0.5 * clip.z / clip.w + 0.5;
      // Flattened normals let many balls read as one body.
      vec3 normal = transpose(mat3(view)) * normalize(n * vec3(0.75, 0.75, 1.0));
      vec3 toEye = transpose(mat3(view)) * normalize(-p);
      color = vec4(lit(tint, normal, toEye, 0.4, 0.04, open * (1.0 - 0.45 * r2)), 1.0);
    }`],

  // Overlays: see-through dots.
  dots: [`#version 300 es
    precision highp float;
    layout(location = 0) in float x;
    layout(location = 1) in float y;
    layout(location = 2) in float z;
    uniform mat4 view, projection;
    uniform vec3 low, size;
    uniform float radius, pixels;
    void main() {
      vec4 seen = view * vec4(low + size * vec3(x, y, z), 1.0);
      gl_Position = projection * seen;
      gl_PointSize = max(2.0 * radius * pixels / -seen.z, 2.0);
    }`, `#version 300 es
    precision highp float;
    uniform vec4 tint;
    out vec4 color;
    void main() {
      float r = length(gl_PointCoord * 2.0 - 1.0);
      if (r > 1.0) discard;
      color = vec4(tint.rgb, tint.a * (1.0 - 0.6 * r));
    }`],

  // Ways of particles: paler where they begin.
  ways: [`#version 300 es
    precision highp float;
    layout(location = 0) in float x;
    layout(location = 1) in float y;
    layout(location = 2) in float z;
    uniform mat4 view, projection;
    uniform vec3 low, size;
    out float end;
    void main() {
      end = float(gl_VertexID & 1);
      gl_Position = projection * view * vec4(low + size * vec3(x, y, z), 1.0);
    }`, `#version 300 es
    precision highp float;
    uniform vec4 tint;
    in float end;
    out vec4 color;
    void main() { color = vec4(tint.rgb, tint.a * mix(0.25, 1.0, end)); }`],

  // Tools: shaded triangles.
  mesh: [`#version 300 es
    precision highp float;
    layout(location = 0) in vec3 position;
    layout(location = 1) in vec3 normal;
    uniform mat4 view, projection, model;
    out vec3 n, p;
    void main() {
      vec4 world = model * vec4(position, 1.0);
      n = mat3(model) * normal;
      p = world.xyz;
      gl_Position = projection * view * world;
    }`, `#version 300 es
    precision highp float;
    uniform vec3 tint, eye;
    uniform float shine, opacity;
    in vec3 n, p;
    out vec4 color;
    ${LIGHT}
    void main() { color = vec4(lit(tint, normalize(n), normalize(eye - p), 0.0, shine, 1.0), opacity); }`],

  // The table's top, fading into the page, with what the lamp does not reach.
  table: [`#version 300 es
    precision highp float;
    layout(location = 0) in vec2 corner;
    uniform mat4 view, projection;
    uniform vec3 middle;
    uniform float table, extent;
    out vec2 p;
    void main() {
      p = middle.xz + corner * extent;
      gl_Position = projection * view * vec4(p.x, table, p.y, 1.0);
    }`, `#version 300 es
    precision highp float;
    uniform sampler2D shadow;
    uniform vec3 middle, top, backdrop;
    uniform float extent, shadowExtent;
    in vec2 p;
    out vec4 color;
    void main() {
      vec2 uv = (p - middle.xz) / shadowExtent * 0.5 + 0.5;
      float dark = 0.0;
      for (int i = -3; i <= 3; i++) for (int j = -3; j <= 3; j++) dark += texture(shadow, uv + vec2(i, j) / 190.0).r;
      vec2 g = abs(fract(p * 20.0 + 0.5) - 0.5) / fwidth(p * 20.0);
      float line = 0.10 * (1.0 - min(min(g.x, g.y), 1.0));
      vec3 c = top * (1.0 - 0.5 * dark / 49.0) * (1.0 - line);
      color = vec4(mix(c, backdrop, smoothstep(0.25, 1.0, length(p - middle.xz) / extent)), 1.0);
    }`],

  // Where the dough's shadow falls on the table: dots along the lamp's direction.
  shadow: [`#version 300 es
    precision highp float;
    layout(location = 0) in float x;
    layout(location = 1) in float y;
    layout(location = 2) in float z;
    uniform vec3 low, size, middle;
    uniform float radius, table, shadowExtent;
    void main() {
      vec3 p = low + size * vec3(x, y, z);
      p -= vec3(-0.461, 0.838, 0.293) * (p.y - table) / 0.838;
      gl_Position = vec4((p.xz - middle.xz) / shadowExtent, 0.0, 1.0);
      gl_PointSize = radius / shadowExtent * 256.0 * 1.3;
    }`, `#version 300 es
    precision highp float;
    out vec4 color;
    void main() { if (length(gl_PointCoord - 0.5) > 0.5) discard; color = vec4(1.0); }`],

  shadowMesh: [`#version 300 es
    precision highp float;
    layout(location = 0) in vec3 position;
    uniform mat4 model;
    uniform vec3 middle;
    uniform float table, shadowExtent;
    void main() {
      vec3 p = (model * vec4(position, 1.0)).xyz;
      p -= vec3(-0.461, 0.838, 0.293) * (p.y - table) / 0.838;
      gl_Position = vec4((p.xz - middle.xz) / shadowExtent, 0.0, 1.0);
    }`, `#version 300 es
    precision highp float;
    out vec4 color;
    void main() { color = vec4(0.8); }`],
};
