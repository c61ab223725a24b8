'use strict';
const byId = id => document.getElementById(id);

// The recording, field by field as view_page.cpp writes it: little-endian, counts before contents.
const data = new DataView(Uint8Array.from(atob(byId('recording').textContent),
                                          letter => letter.charCodeAt(0)).buffer);
let read = 0;
const take = (get, size) => { read += size; return data[get](read - size, true); };
const float = () => take('getFloat32', 4), double = () => take('getFloat64', 8);
const short = () => take('getUint16', 2), word = () => take('getUint32', 4);
const count = () => Number(take('getBigUint64', 8)), whole = () => Number(take('getBigInt64', 8));
const list = item => Array.from({length: count()}, item);
const floats = () => { const n = count(), out = new Float32Array(n); return out.map(float); };
const text = () => new TextDecoder().decode(Uint8Array.from(list(() => take('getUint8', 1))));

const NUMBERS = 8, AWAY = 0xffff;
const run = {
  name: text(), dt_s: double(), up: [double(), double(), double()], worlds: word(),
  bodies: list(() => ({label: word(), shape: word()})),
  statics: list(() => ({name: text(), shape: word(), pose: floats()})),
  steps: list(whole),
};
const shapes = list(floats);
const grid = {origin: [double(), double(), double()], size: double(),
              cells: [word(), word(), word()]};
const cellOwners = list(short);
const changes = list(() => ({frame: word(), cell: word(), from: short(), to: short()}));
const numbers = floats();
const owners = Uint16Array.from(list(short));

// Vectors
const add = (a, b, s = 1) => [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
                         a[0] * b[1] - a[1] * b[0]];
const scaled = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
const unit = a => scaled(a, 1 / Math.hypot(...a));

// What is where
const radii = shapes.map(shape => {
  let most = 0;
  for (let i = 0; i < shape.length; i += 6)
    most = Math.max(most, Math.hypot(shape[i], shape[i + 1], shape[i + 2]));
  return most;
});
const ownerOf = (frame, body) => owners[frame * run.bodies.length + body];
const isThere = (frame, body) => ownerOf(frame, body) !== AWAY;
const numbersOf = (frame, body) => {
  const at = (frame * run.bodies.length + body) * NUMBERS;
  return numbers.subarray(at, at + NUMBERS);
};

// Of nine in ten bodies along each axis, at the beginning, halfway and at the end.
function extent() {
  const frames = [0, run.steps.length >> 1, run.steps.length - 1], low = [], high = [];
  for (let k = 0; k < 3; ++k) {
    const at = [];
    for (const frame of frames) run.bodies.forEach((body, i) => {
      if (isThere(frame, i)) at.push(numbersOf(frame, i)[k]);
    });
    at.sort((a, b) => a - b);
    low[k] = at[Math.floor(0.05 * at.length)] || 0;
    high[k] = at[Math.ceil(0.95 * at.length) - 1] || 0;
  }
  const largest = Math.max(...run.bodies.slice(0, 1000).map(body => radii[body.shape]), 1e-9);
  const reach = 0.5 * Math.hypot(...add(high, low, -1)) + largest;
  return {middle: scaled(add(low, high), 0.5), reach};
}
const seen = extent();
let fastest = 0;
for (let i = NUMBERS - 1; i < numbers.length; i += NUMBERS) fastest = Math.max(fastest, numbers[i]);

// The eye: at `distance` from `target`, up being against gravity.

const up = run.up;
const east = unit(Math.abs(up[0]) < 0.9 ? add([1, 0, 0], up, -up[0]) : add([0, 1, 0], up, -up[1]));
const north = cross(up, east);
const eye = {target: seen.middle, distance: 2.2 * seen.reach, azimuth: -1.1, height: 0.42};

function eyeAxes() {
  const level = add(scaled(east, Math.cos(eye.azimuth)), north, Math.sin(eye.azimuth));
  const back = add(scaled(level, Math.cos(eye.height)), up, Math.sin(eye.height));
  const right = unit(cross(up, back));
  return {back, right, above: cross(back, right), place: add(eye.target, back, eye.distance)};
}
const FIELD = 0.45;  // tangent of half the vertical field of view

function projection(axes, aspect) {
  const near = eye.distance / 100, far = eye.distance * 100, f = 1 / FIELD;
  const {right, above, back, place} = axes;
  const depth = (far + near) / (near - far), shift = 2 * far * near / (near - far);
  const rows = [
    [...scaled(right, f / aspect), -dot(right, place) * f / aspect],
    [...scaled(above, f), -dot(above, place) * f],
    [...scaled(back, depth), -dot(back, place) * depth + shift],
    [...scaled(back, -1), dot(back, place)]];
  const matrix = new Float32Array(16);
  rows.forEach((row, r) => row.forEach((value, c) => { matrix[4 * c + r] = value; }));
  return matrix;
}

// Colours
function hue(h, light = 0.55, strength = 0.55) {
  const channel = n => {
    const k = (n + h * 12) % 12;
    return light - strength * Math.min(light, 1 - light) *
      Math.max(-1, Math.min(k - 3, 9 - k, 1));
  };
  return [channel(0), channel(8), channel(4)];
}
// Neighbouring bodies of one world differ a little.
const worldColour = (world, body) =>
  hue((0.58 + world * 0.618034) % 1, (world % 2 ? 0.48 : 0.58) + 0.08 * ((body * 0.618034) % 1));
const speedColour = speed => hue(0.62 * (1 - Math.sqrt(speed / (fastest || 1))), 0.52, 0.75);

// Drawing
const canvas = byId('canvas');
const gl = canvas.getContext('webgl', {alpha: false});
if (!gl) byId('told').textContent = 'This page needs WebGL.';

const VERTEX = `
  attribute vec3 corner, normal;
  uniform mat4 view; uniform vec3 place; uniform vec4 turn;
  varying vec3 outward; varying vec3 at;
  vec3 turned(vec3 v) { return v + 2. * cross(turn.yzw, cross(turn.yzw, v) + turn.x * v); }
  void main() {
    outward = turned(normal);
    at = turned(corner) + place;
    gl_Position = view * vec4(at, 1.);
  }`;
const FRAGMENT = `
  precision mediump float;
  varying vec3 outward; varying vec3 at;
  uniform vec4 colour; uniform vec3 up, light; uniform float lit;
  void main() {
    vec3 n = normalize(outward);
    float shade = .55 + .2 * dot(n, up) + .3 * max(0., dot(n, light));
    gl_FragColor = vec4(colour.rgb * mix(1., shade, lit), colour.a);
  }`;

function compiled(kind, text) {
  const shader = gl.createShader(kind);
  gl.shaderSource(shader, text);
  gl.compileShader(shader);
  return shader;
}
const program = gl.createProgram();
gl.attachShader(program, compiled(gl.VERTEX_SHADER, VERTEX));
gl.attachShader(program, compiled(gl.FRAGMENT_SHADER, FRAGMENT));
gl.linkProgram(program);
gl.useProgram(program);
const place = {};
for (const name of ['view', 'place', 'turn', 'colour', 'up', 'light', 'lit'])
  place[name] = gl.getUniformLocation(program, name);
const CORNER = gl.getAttribLocation(program, 'corner');
const NORMAL = gl.getAttribLocation(program, 'normal');

function buffer(floats) {
  const made = gl.createBuffer();
  gl.bindBuffer(gl.ARRAY_BUFFER, made);
  gl.bufferData(gl.ARRAY_BUFFER, floats, gl.STATIC_DRAW);
  return made;
}
function bind(made) {
  gl.bindBuffer(gl.ARRAY_BUFFER, made);
  gl.enableVertexAttribArray(CORNER);
  gl.enableVertexAttribArray(NORMAL);
  gl.vertexAttribPointer(CORNER, 3, gl.FLOAT, false, 24, 0);
  gl.vertexAttribPointer(NORMAL, 3, gl.FLOAT, false, 24, 12);
}
const shapeBuffers = shapes.map(buffer);

// Territories: who owns each cell in the frame that is shown, with a layer of nobody's around.
const wide = grid.cells.map(n => n + 2), strides = [wide[1] * wide[2], wide[2], 1];
const held = new Int32Array(wide[0] * wide[1] * wide[2]).fill(-1);
function placeOfCell(cell) {
  const column = Math.floor(cell / grid.cells[2]), [, deep, high] = grid.cells;
  return (Math.floor(column / deep) + 1) * strides[0] + (column % deep + 1) * strides[1] +
    cell % high + 1;
}
cellOwners.forEach((owner, cell) => { held[placeOfCell(cell)] = owner; });
let changed = 0;  // how many of the changes are in `held`

function bringTerritoriesTo(frame) {
  const before = changed;
  for (; changed < changes.length && changes[changed].frame <= frame; ++changed)
    held[placeOfCell(changes[changed].cell)] = changes[changed].to;
  for (; changed > 0 && changes[changed - 1].frame > frame; --changed)
    held[placeOfCell(changes[changed - 1].cell)] = changes[changed - 1].from;
  if (changed !== before) linesDrawn = fillLines();
}

// The level edges of borders; an edge between two faces in one plane is none.
function borderLines() {
  const floats = [], apart = (a, b) => a >= 0 && b >= 0 && a !== b;
  for (let axis = 0; axis < 3; ++axis) {
    if (Math.abs(up[axis]) > 0.99) continue;
    const b = strides[(axis + 1) % 3], c = strides[(axis + 2) % 3];
    for (let i = b + c; i < held.length; ++i) {
      const p = held[i], q = held[i - b], r = held[i - b - c], s = held[i - c];
      if (p === q && q === r && r === s) continue;
      const pq = apart(p, q), qr = apart(q, r), rs = apart(r, s), sp = apart(s, p);
      const faces = pq + qr + rs + sp;
      if (faces === 0 || (faces === 2 && pq === rs)) continue;
      const cell = strides.map((stride, k) => Math.floor(i / stride) % wide[k] - 1);
      const end = add(grid.origin, cell, grid.size);
      const way = [0, 1, 2].map(k => k === axis ? grid.size : 0);
      floats.push(...end, ...up, ...add(end, way), ...up);
    }
  }
  return new Float32Array(floats);
}
const lineBuffer = gl.createBuffer();
function fillLines() {
  const floats = borderLines();
  gl.bindBuffer(gl.ARRAY_BUFFER, lineBuffer);
  gl.bufferData(gl.ARRAY_BUFFER, floats, gl.DYNAMIC_DRAW);
  return floats.length / 6;
}
let linesDrawn = fillLines();

const byShape = shapes.map(() => []);
run.bodies.forEach((body, i) => byShape[body.shape].push(i));

function drawOne(shape, pose, colour) {
  gl.uniform3f(place.place, pose[0], pose[1], pose[2]);
  gl.uniform4f(place.turn, pose[3], pose[4], pose[5], pose[6]);
  gl.uniform4f(place.colour, ...colour, 1);
  gl.drawArrays(gl.TRIANGLES, 0, shapes[shape].length / 6);
}

function draw() {
  const scale = window.devicePixelRatio || 1;
  canvas.width = canvas.clientWidth * scale;
  canvas.height = canvas.clientHeight * scale;
  gl.viewport(0, 0, canvas.width, canvas.height);
  gl.clearColor(0.957, 0.961, 0.969, 1);
  gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  gl.enable(gl.DEPTH_TEST);
  gl.enable(gl.POLYGON_OFFSET_FILL);  // so that lines on the ground are seen
  gl.polygonOffset(1, 1);
  const axes = eyeAxes();
  gl.uniformMatrix4fv(place.view, false, projection(axes, canvas.width / canvas.height));
  gl.uniform3f(place.up, ...up);
  gl.uniform3f(place.light, ...unit(add(add(axes.back, axes.right, 0.6), up, 0.8)));
  gl.uniform1f(place.lit, 1);
  run.statics.forEach((still, i) => {
    bind(shapeBuffers[still.shape]);
    drawOne(still.shape, still.pose, Array(3).fill(0.92 - 0.12 * ((i * 0.618034) % 1)));
  });
  const bySpeed = byId('colour').value === 'speed';
  byShape.forEach((bodies, shape) => {
    if (bodies.length === 0) return;
    bind(shapeBuffers[shape]);
    for (const body of bodies.filter(body => isThere(frame, body))) {
      const pose = numbersOf(frame, body);
      const colour = bySpeed ? speedColour(pose[7]) : worldColour(ownerOf(frame, body), body);
      drawOne(shape, pose, body === chosen ? [1, 0.95, 0.3] : colour);
    }
  });
  if (byId('borders').checked && linesDrawn > 0) {
    bind(lineBuffer);
    gl.uniform1f(place.lit, 0);
    gl.uniform3f(place.place, 0, 0, 0);
    gl.uniform4f(place.turn, 1, 0, 0, 0);
    gl.uniform4f(place.colour, 0.1, 0.2, 0.45, 0.5);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    gl.drawArrays(gl.LINES, 0, linesDrawn);
    gl.disable(gl.BLEND);
  }
}

// Time
let frame = 0, chosen = -1, playing = false, shownAt = 0, time = 0;
const last = run.steps.length - 1;
byId('frame').max = last;

function tell() {
  bringTerritoriesTo(frame);
  byId('frame').value = frame;
  byId('clock').textContent =
    `step ${run.steps[frame]}, ${(run.steps[frame] * run.dt_s).toFixed(3)} s` +
    (changes.length > 0 ? `, ${changed} cells changed hands` : '');
  byId('told').textContent = chosen < 0 ? '' : describe(chosen);
}
function describe(body) {
  const head = `body ${run.bodies[body].label}`;
  if (!isThere(frame, body)) return `${head}: not there`;
  const at = Array.from(numbersOf(frame, body));
  return `${head}, in the territory of world ${ownerOf(frame, body)}\n` +
    `at ${at.slice(0, 3).map(x => x.toPrecision(6)).join(', ')} m\n` +
    `speed ${at[7].toPrecision(4)} m/s`;
}
function show(next) {
  frame = Math.max(0, Math.min(last, next));
  time = run.steps[frame] * run.dt_s;
  tell();
  draw();
}
function play(on) {
  playing = on;
  byId('play').textContent = on ? 'pause' : 'play';
  if (!on) return;
  if (frame === last) show(0);
  shownAt = performance.now();
  requestAnimationFrame(advance);
}
function advance(now) {
  if (!playing) return;
  time += (now - shownAt) / 1000 * Number(byId('rate').value);
  shownAt = now;
  let next = frame;
  while (next < last && run.steps[next + 1] * run.dt_s <= time) ++next;
  if (next !== frame) {
    frame = next;
    tell();
    draw();
  }
  if (frame === last) play(false);
  else requestAnimationFrame(advance);
}

// Mouse and keys
let dragged = null;
canvas.addEventListener('pointerdown', event => {
  dragged = {x: event.clientX, y: event.clientY, moved: 0, pans: event.button > 0 || event.shiftKey};
  canvas.setPointerCapture(event.pointerId);
});
canvas.addEventListener('pointermove', event => {
  if (!dragged) return;
  const dx = event.clientX - dragged.x, dy = event.clientY - dragged.y;
  Object.assign(dragged, {x: event.clientX, y: event.clientY,
                          moved: dragged.moved + Math.abs(dx) + Math.abs(dy)});
  if (dragged.pans) {
    const axes = eyeAxes(), step = 2 * FIELD * eye.distance / canvas.clientHeight;
    eye.target = add(add(eye.target, axes.right, -dx * step), axes.above, dy * step);
  } else {
    eye.azimuth -= dx * 0.008;
    eye.height = Math.max(-1.5, Math.min(1.5, eye.height + dy * 0.008));
  }
  draw();
});
canvas.addEventListener('pointerup', event => {
  if (dragged && dragged.moved < 4) choose(event.clientX, event.clientY);
  dragged = null;
});
canvas.addEventListener('contextmenu', event => event.preventDefault());
canvas.addEventListener('wheel', event => {
  event.preventDefault();
  eye.distance *= Math.exp(event.deltaY * 0.001);
  draw();
}, {passive: false});
document.addEventListener('keydown', event => {
  if (event.key === ' ') play(!playing);
  else if (event.key === 'ArrowRight') show(frame + 1);
  else if (event.key === 'ArrowLeft') show(frame - 1);
  else return;
  event.preventDefault();
});

// The nearest body whose bounding sphere the ray meets.
function choose(x, y) {
  const axes = eyeAxes(), height = canvas.clientHeight, width = canvas.clientWidth;
  const across = FIELD * (2 * x - width) / height, above = FIELD * (height - 2 * y) / height;
  const ray = unit(add(add(scaled(axes.back, -1), axes.right, across), axes.above, above));
  let nearest = Infinity;
  chosen = -1;
  run.bodies.forEach((body, i) => {
    if (!isThere(frame, i)) return;
    const away = add(Array.from(numbersOf(frame, i)), axes.place, -1), along = dot(away, ray);
    const aside = Math.hypot(...add(away, ray, -along));
    if (aside < 0.8 * radii[body.shape] && along > 0 && along < nearest)
      [nearest, chosen] = [along, i];
  });
  tell();
  draw();
}

byId('what').append(Object.assign(document.createElement('b'), {textContent: run.name}),
  `: ${run.bodies.length} bodies, ${run.worlds} worlds`);
byId('play').onclick = () => play(!playing);
byId('frame').oninput = event => { play(false); show(Number(event.target.value)); };
byId('colour').onchange = byId('borders').onchange = draw;
window.onresize = draw;
// page.html#step=120&colour=speed&azimuth=-1&height=.5&distance=20
const asked = new URLSearchParams(location.hash.slice(1));
for (const name of ['azimuth', 'height', 'distance'])
  if (asked.has(name)) eye[name] = Number(asked.get(name));
if (asked.has('colour')) byId('colour').value = asked.get('colour');
if (asked.has('borders')) byId('borders').checked = asked.get('borders') !== 'off';
const from = run.steps.findIndex(step => step >= Number(asked.get('step') || 0));
show(from < 0 ? last : from);
