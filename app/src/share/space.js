// The shelf in three dimensions: WebGL 2, one draw for each side of the cubes that the eye can see. Each face is four equal
// vertices that know by their number which corner they are; instances would be more natural, but drawing without a graphics
// card takes a hundred times as long with them.

const DEFAULT_CAMERA = { turn: 0.0, tilt: 0.42, distance: 1.0, pan: [0, 0, 0] };
const FIELD = 0.62; // vertical field of view, radians

const FACE_SHADER = `#version 300 es
layout(location = 0) in uvec4 place;
layout(location = 1) in vec4 colour;
uniform mat4 clip_from_world;
uniform vec3 origin, corner, along, across;
uniform float edge, shade;
out vec2 at;
out vec3 tint;
void main() {
  vec2 size = vec2(1.0, float(place.w));
  at = vec2(gl_VertexID & 1, (gl_VertexID >> 1) & 1) * size;
  vec3 point = vec3(place.xyz) + corner + along * at.x + across * at.y;
  tint = colour.rgb * shade;
  gl_Position = clip_from_world * vec4(origin + edge * point, 1.0);
}`;

// Lines between voxels fade out where a voxel is only a few pixels wide.
const FACE_PAINT = `#version 300 es
precision mediump float;
in vec2 at;
in vec3 tint;
out vec4 painted;
void main() {
  vec2 width = max(fwidth(at), vec2(1e-4));
  vec2 near = min(fract(at), 1.0 - fract(at)) / width;
  float line = 1.0 - smoothstep(0.3, 1.1, min(near.x, near.y));
  float fade = 1.0 - smoothstep(0.1, 0.28, max(width.x, width.y));
  painted = vec4(tint * (1.0 - 0.24 * line * fade), 1.0);
}`;

const LINE_SHADER = `#version 300 es
layout(location = 0) in vec3 from;
layout(location = 1) in vec3 to;
layout(location = 2) in vec4 colour;
uniform mat4 clip_from_world;
uniform vec2 pixels;
uniform float width, lift;
out vec4 tint;
void main() {
  vec4 a = clip_from_world * vec4(from, 1.0);
  vec4 b = clip_from_world * vec4(to, 1.0);
  vec2 way = (b.xy / b.w - a.xy / a.w) * pixels;
  vec2 side = length(way) > 1e-3 ? normalize(vec2(-way.y, way.x)) : vec2(0.0, 1.0);
  vec4 end = (gl_VertexID & 1) == 0 ? a : b;
  end.xy += side * (((gl_VertexID >> 1) & 1) == 0 ? -width : width) / pixels * end.w;
  end.z -= lift * end.w;
  tint = colour;
  gl_Position = end;
}`;

const FLAT_PAINT = `#version 300 es
precision mediump float;
in vec4 tint;
out vec4 painted;
void main() {
  painted = vec4(tint.rgb * tint.a, tint.a);
}`;

const PANEL_SHADER = `#version 300 es
layout(location = 0) in vec3 point;
uniform mat4 clip_from_world;
uniform vec4 colour;
out vec4 tint;
void main() {
  tint = colour;
  gl_Position = clip_from_world * vec4(point, 1.0);
}`;

// By side: corner of the face, its two edges, and how light it is.
const SIDES = [
  [[0, 0, 0], [0, 1, 0], [0, 0, 1], 0.72],
  [[1, 0, 0], [0, 1, 0], [0, 0, 1], 0.72],
  [[0, 0, 0], [1, 0, 0], [0, 0, 1], 0.86],
  [[0, 1, 0], [1, 0, 0], [0, 0, 1], 0.64],
  [[0, 0, 0], [1, 0, 0], [0, 1, 0], 0.55],
  [[0, 0, 1], [1, 0, 0], [0, 1, 0], 1.0],
];

const minus = (a, b) => a.map((value, at) => value - b[at]);
const dot = (a, b) => a.reduce((sum, value, at) => sum + value * b[at], 0);
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = (a) => a.map((value) => value / Math.hypot(...a));

// Product of two matrices, columns first.
function product(a, b) {
  const out = new Float32Array(16);
  for (let column = 0; column < 4; column++) {
    for (let row = 0; row < 4; row++) {
      for (let k = 0; k < 4; k++) out[4 * column + row] += a[4 * k + row] * b[4 * column + k];
    }
  }
  return out;
}

function program(gl, vertex, fragment) {
  const made = gl.createProgram();
  for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    gl.attachShader(made, shader);
  }
  gl.linkProgram(made);
  if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made));
  const at = (name) => gl.getUniformLocation(made, name);
  return { made, at: new Proxy({}, { get: (_, name) => at(name) }) };
}

// Whether WebGL is drawn by the processor, where smooth edges cost as much as all the rest.
function drawsInSoftware() {
  const gl = document.createElement("canvas").getContext("webgl2");
  const told = gl?.getExtension("WEBGL_debug_renderer_info");
  const name = told ? gl.getParameter(told.UNMASKED_RENDERER_WEBGL) : "";
  gl?.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|software|basic render/i.test(name);
}

class Space {
  // Throws where there is no WebGL 2.
  constructor(canvas) {
    this.canvas = canvas;
    const options = { alpha: true, antialias: !drawsInSoftware(), preserveDrawingBuffer: true, powerPreference: "low-power" };
    this.gl = canvas.getContext("webgl2", options);
    if (!this.gl) throw new Error("no WebGL 2");
    canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
    canvas.addEventListener("webglcontextrestored", () => {
      this.begin();
      canvas.dispatchEvent(new Event("redraw"));
    });
    this.frames = 0;
    this.begin();
  }

  begin() {
    const gl = this.gl;
    this.faces = program(gl, FACE_SHADER, FACE_PAINT);
    this.strokes = program(gl, LINE_SHADER, FLAT_PAINT);
    this.panels = program(gl, PANEL_SHADER, FLAT_PAINT);
    this.corners = { buffer: gl.createBuffer(), quads: 0 };
    this.sides = SIDES.map(() => this.vertices([[gl.UNSIGNED_SHORT, 4, 0, true], [gl.UNSIGNED_BYTE, 4, 8, false]], 12));
    const floats = [[gl.FLOAT, 3, 0, false], [gl.FLOAT, 3, 12, false], [gl.UNSIGNED_BYTE, 4, 24, false]];
    this.lines = this.vertices(floats, 28);
    this.walls = this.vertices([[gl.FLOAT, 3, 0, false]], 12);
  }

  // A buffer whose attributes are type, count, offset, and whether they are whole numbers.
  vertices(attributes, stride) {
    const gl = this.gl;
    const [array, buffer] = [gl.createVertexArray(), gl.createBuffer()];
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    attributes.forEach(([type, count, offset, isWhole], at) => {
      gl.enableVertexAttribArray(at);
      if (isWhole) gl.vertexAttribIPointer(at, count, type, stride, offset);
      else gl.vertexAttribPointer(at, count, type, type === gl.UNSIGNED_BYTE, stride, offset);
    });
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.corners.buffer);
    gl.bindVertexArray(null);
    return { array, buffer, count: 0 };
  }

  fill(vertices, data, count) {
    const gl = this.gl;
    gl.bindBuffer(gl.ARRAY_BUFFER, vertices.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
    vertices.count = count;
  }

  // Quads, each of `words` words, as four vertices each.
  fillQuads(vertices, quads, words) {
    const count = quads.length / words;
    const data = new Uint32Array(4 * quads.length);
    for (let quad = 0, at = 0; quad < count; quad++) {
      for (let corner = 0; corner < 4; corner++) for (let word = 0; word < words; word++) data[at++] = quads[quad * words + word];
    }
    this.fill(vertices, data, count);
    if (count <= this.corners.quads) return;
    const gl = this.gl;
    const indices = new Uint32Array(6 * count);
    for (let quad = 0; quad < count; quad++) indices.set([0, 1, 2, 2, 1, 3].map((corner) => 4 * quad + corner), 6 * quad);
    gl.bindVertexArray(null);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.corners.buffer);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, indices, gl.STATIC_DRAW);
    this.corners.quads = count;
  }

  drawQuads(vertices) {
    const gl = this.gl;
    gl.bindVertexArray(vertices.array);
    gl.drawElements(gl.TRIANGLES, 6 * vertices.count, gl.UNSIGNED_INT, 0);
  }

  // The shelf's interior, from its grid.
  setShelf({ dims, voxel_m, origin }) {
    this.low = origin;
    this.high = origin.map((value, axis) => value + dims[axis] * voxel_m);
    const [[x, y, z], [X, Y, Z]] = [this.low.map((m) => m - 0.0015), this.high.map((m) => m + 0.0015)];
    const quads = [
      [[x, y, z], [X, y, z], [x, Y, z], [X, Y, z]],
      [[x, Y, z], [X, Y, z], [x, Y, Z], [X, Y, Z]],
      [[x, y, z], [x, Y, z], [x, y, Z], [x, Y, Z]],
      [[X, y, z], [X, Y, z], [X, y, Z], [X, Y, Z]],
    ];
    this.fill(this.walls, new Float32Array(quads.flat(2)), 16);
  }

  setFaces(sides, edge) {
    sides.forEach((side, at) => this.fillQuads(this.sides[at], side.filled, 3));
    this.edge = edge;
  }

  // Segments as pairs of points with a colour of four bytes.
  setLines(segments) {
    const data = new ArrayBuffer(28 * segments.length);
    const [floats, bytes] = [new Float32Array(data), new Uint8Array(data)];
    segments.forEach(([from, to, colour], at) => {
      floats.set(from, 7 * at);
      floats.set(to, 7 * at + 3);
      bytes.set(colour, 28 * at + 24);
    });
    this.fillQuads(this.lines, new Uint32Array(data), 7);
  }

  // How far the eye has to be to see the whole shelf from its usual place.
  fitting(aspect) {
    const { toEye, right, up } = this.axes(DEFAULT_CAMERA);
    const half = this.high.map((high, at) => 0.5 * (high - this.low[at]));
    const tangent = Math.tan(0.5 * FIELD) * 0.9;
    let far = 0;
    for (let corner = 0; corner < 8; corner++) {
      const place = half.map((value, axis) => ((corner >> axis) & 1 ? value : -value));
      const across = Math.max(Math.abs(dot(place, right)) / (tangent * aspect), Math.abs(dot(place, up)) / tangent);
      far = Math.max(far, across + dot(place, toEye));
    }
    return far;
  }

  axes({ turn, tilt }) {
    const toEye = [Math.sin(turn) * Math.cos(tilt), -Math.cos(turn) * Math.cos(tilt), Math.sin(tilt)];
    const right = [Math.cos(turn), Math.sin(turn), 0];
    return { toEye, right, up: cross(toEye, right) };
  }

  eyeOf(camera, aspect) {
    const axes = this.axes(camera);
    const middle = this.low.map((low, at) => 0.5 * (low + this.high[at]) + camera.pan[at]);
    const far = this.fitting(aspect) * camera.distance;
    return { ...axes, middle, far, eye: middle.map((value, at) => value + far * axes.toEye[at]) };
  }

  matrix({ toEye, right, up, eye, far }, aspect) {
    const scale = 1 / Math.tan(0.5 * FIELD);
    const [near, last] = [Math.max(0.01, far - 1.6), far + 2.5];
    const lens = new Float32Array(16);
    lens.set([scale / aspect, 0, 0, 0, 0, scale, 0, 0, 0, 0, (last + near) / (near - last), -1, 0, 0, (2 * last * near) / (near - last), 0]);
    const view = new Float32Array(16);
    [right, up, toEye].forEach((axis, row) => {
      axis.forEach((value, column) => (view[4 * column + row] = value));
      view[12 + row] = -dot(axis, eye);
    });
    view[15] = 1;
    return product(lens, view);
  }

  // As large as it stands on the page, or of a given size in pixels.
  draw(camera, theme, size = null) {
    const { gl, canvas } = this;
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const [width, height] = size ?? [canvas.clientWidth, canvas.clientHeight].map((length) => Math.max(1, Math.round(length * ratio)));
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    const aspect = width / height;
    const seen = this.eyeOf(camera, aspect);
    const matrix = this.matrix(seen, aspect);
    gl.viewport(0, 0, width, height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.disable(gl.BLEND);
    this.drawWalls(matrix, seen.eye, theme);
    this.drawFaces(matrix, seen.eye);
    this.drawLines(matrix, [width, height], ratio);
    canvas.dataset.frames = ++this.frames;
  }

  // Board, back and sides, from inside alone, so that one can look in from everywhere.
  drawWalls(matrix, eye, theme) {
    const { gl, low, high } = this;
    gl.useProgram(this.panels.made);
    gl.uniformMatrix4fv(this.panels.at.clip_from_world, false, matrix);
    gl.bindVertexArray(this.walls.array);
    const isInside = [eye[2] > low[2], eye[1] < high[1], eye[0] > low[0], eye[0] < high[0]];
    theme.walls.forEach((colour, at) => {
      if (!isInside[at]) return;
      gl.uniform4f(this.panels.at.colour, ...colour.map((value) => value / 255), 1);
      gl.drawArrays(gl.TRIANGLE_STRIP, 4 * at, 4);
    });
  }

  drawFaces(matrix, eye) {
    const { gl, low, high, faces } = this;
    gl.useProgram(faces.made);
    gl.uniformMatrix4fv(faces.at.clip_from_world, false, matrix);
    gl.uniform3f(faces.at.origin, ...low);
    gl.uniform1f(faces.at.edge, this.edge ?? 1);
    // A side shows unless the eye is behind all planes of its kind.
    const shows = [0, 1, 2].flatMap((axis) => [eye[axis] < high[axis], eye[axis] > low[axis]]);
    SIDES.forEach(([corner, along, across, shade], at) => {
      if (!shows[at] || !this.sides[at].count) return;
      gl.uniform3f(faces.at.corner, ...corner);
      gl.uniform3f(faces.at.along, ...along);
      gl.uniform3f(faces.at.across, ...across);
      gl.uniform1f(faces.at.shade, shade);
      this.drawQuads(this.sides[at]);
    });
  }

  drawLines(matrix, pixels, ratio) {
    const { gl, strokes } = this;
    if (!this.lines.count) return;
    gl.useProgram(strokes.made);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.uniformMatrix4fv(strokes.at.clip_from_world, false, matrix);
    gl.uniform2f(strokes.at.pixels, ...pixels);
    gl.uniform1f(strokes.at.width, 1.5 * ratio);
    gl.uniform1f(strokes.at.lift, 0.0006);
    this.drawQuads(this.lines);
  }
}
