
// The run in three dimensions
const canvas = byId('scene');
const gl = canvas.getContext('webgl2', {alpha: false, antialias: true});
if (!gl) byId('no-webgl').hidden = false;

const SOLID = [`#version 300 es
  in vec3 corner, normal;
  in vec3 place; in vec4 turn; in vec4 colour; in float size;
  uniform mat4 view;
  out vec3 outward; out vec4 tint;
  vec3 turned(vec3 v) { return v + 2. * cross(turn.yzw, cross(turn.yzw, v) + turn.x * v); }
  void main() {
    outward = turned(normal);
    tint = colour;
    gl_Position = view * vec4(turned(corner) * size + place, 1.);
  }`, `#version 300 es
  precision mediump float;
  in vec3 outward; in vec4 tint;
  uniform vec3 up, light;
  out vec4 pixel;
  void main() {
    vec3 n = normalize(outward);
    float shade = .55 + .2 * dot(n, up) + .3 * max(0., dot(n, light));
    pixel = vec4(tint.rgb * shade, tint.a);
  }`];
// Six corners a line: which end (x), which side (y). What hides lines must be `before` them by
// more than so much along the way to the eye.
const STROKE = [`#version 300 es
  in vec2 corner;
  in vec3 from, to; in vec4 colour; in float width;
  uniform mat4 view; uniform vec2 pixels; uniform vec3 before;
  out vec4 tint;
  void main() {
    vec4 a = view * vec4(from, 1.), b = view * vec4(to, 1.);
    float near = 1e-4;
    if (a.w < near && b.w > near) a = mix(b, a, (b.w - near) / (b.w - a.w));
    if (b.w < near && a.w > near) b = mix(a, b, (a.w - near) / (a.w - b.w));
    vec2 way = (b.xy / b.w - a.xy / a.w) * pixels;
    vec2 side = length(way) > 0. ? normalize(vec2(-way.y, way.x)) : vec2(0.);
    vec4 end = corner.x < .5 ? a : b;
    end.xy += side * corner.y * width / pixels * end.w;
    vec4 nearer = view * vec4((corner.x < .5 ? from : to) + before, 1.);
    if (nearer.w > near) end.z = nearer.z / nearer.w * end.w;
    tint = colour;
    gl_Position = end;
  }`, `#version 300 es
  precision mediump float;
  in vec4 tint;
  out vec4 pixel;
  void main() { pixel = tint; }`];

function programOf([vertex, fragment]) {
  const program = gl.createProgram();
  for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS))
      console.error(gl.getShaderInfoLog(shader));
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  return program;
}
function bufferOf(floats) {
  const buffer = gl.createBuffer();
  gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
  if (floats) gl.bufferData(gl.ARRAY_BUFFER, floats, gl.STATIC_DRAW);
  return buffer;
}
// [name, floats] of a corner or, if `each`, of an instance.
function attributes(program, buffer, fields, each) {
  gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
  const stride = 4 * fields.reduce((sum, [, size]) => sum + size, 0);
  let offset = 0;
  for (const [name, size] of fields) {
    const place = gl.getAttribLocation(program, name);
    gl.enableVertexAttribArray(place);
    gl.vertexAttribPointer(place, size, gl.FLOAT, false, stride, offset);
    gl.vertexAttribDivisor(place, each ? 1 : 0);
    offset += 4 * size;
  }
}

const INSTANCE = 12;
let drawing = null;  // what the graphics card has
function makeDrawing() {
  const solid = programOf(SOLID), stroke = programOf(STROKE);
  const instances = bufferOf(), strokes = bufferOf();
  const shapes = run.shapes.map(shape => {
    const array = gl.createVertexArray();
    gl.bindVertexArray(array);
    attributes(solid, bufferOf(shape), [['corner', 3], ['normal', 3]], false);
    attributes(solid, instances, [['place', 3], ['turn', 4], ['colour', 4], ['size', 1]], true);
    return {array, corners: shape.length / 6};
  });
  const line = gl.createVertexArray();
  gl.bindVertexArray(line);
  attributes(stroke, bufferOf(new Float32Array([0, -1, 1, -1, 1, 1, 0, -1, 1, 1, 0, 1])),
             [['corner', 2]], false);
  attributes(stroke, strokes, [['from', 3], ['to', 3], ['colour', 4], ['width', 1]], true);
  gl.bindVertexArray(null);
  drawing = {solid, stroke, instances, strokes, shapes, line};
}
if (gl) makeDrawing();

function drawInstances(shape, numbers) {
  const {array, corners} = drawing.shapes[shape];
  if (numbers.length === 0 || corners === 0) return;
  gl.bindVertexArray(array);
  gl.bindBuffer(gl.ARRAY_BUFFER, drawing.instances);
  gl.bufferData(gl.ARRAY_BUFFER, numbers, gl.STREAM_DRAW);
  gl.drawArraysInstanced(gl.TRIANGLES, 0, corners, numbers.length / INSTANCE);
}
function drawLines(numbers) {
  if (numbers.length === 0) return;
  gl.bindVertexArray(drawing.line);
  gl.bindBuffer(gl.ARRAY_BUFFER, drawing.strokes);
  gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(numbers), gl.STREAM_DRAW);
  gl.drawArraysInstanced(gl.TRIANGLES, 0, 6, numbers.length / LINE);
}

const byShape = run.shapes.map(() => []);
run.bodies.forEach((body, i) => byShape[body.shape].push(i));

const speedColour = speed => hue(0.62 * (1 - Math.sqrt(Math.min(1, speed / (fastest || 1)))),
                                 0.52, 0.75);
const islandColour = island => hue((0.11 + island * 0.618034) % 1, 0.5 + 0.1 * (island % 3) / 2);
const REST = {resting: [0.45, 0.5, 0.56], moving: [0.95, 0.6, 0.15], kept: [0.8, 0.82, 0.85]};

// Of a body in this frame, by what the page colours by.
function colouring(frame, poses) {
  const by = byId('colour').value;
  if (by === 'speed') return body => speedColour(poses[body * NUMBERS + 7]);
  if (by === 'rest') return body => isResting(frame, body) ? REST.resting : REST.moving;
  if (by === 'island') {
    const {of} = islandsAt(frame), sizes = new Uint32Array(BODIES);
    of.forEach(island => ++sizes[island]);
    return body => sizes[of[body]] < 2 ? REST.kept : islandColour(of[body]);
  }
  return body => worldColour(ownerOf(frame, body), body);
}

function putInstance(numbers, to, poses, body, colour, opacity, size) {
  const at = body * NUMBERS;
  for (let k = 0; k < 7; ++k) numbers[to + k] = poses[at + k];
  numbers[to + 7] = colour[0];
  numbers[to + 8] = colour[1];
  numbers[to + 9] = colour[2];
  numbers[to + 10] = opacity;
  numbers[to + 11] = size;
}

function drawBodies(frame, poses, emphasised) {
  const colourOf = colouring(frame, poses);
  byShape.forEach((bodies, shape) => {
    const numbers = new Float32Array(bodies.length * INSTANCE);
    let count = 0;
    for (const body of bodies) {
      if (!isThere(frame, body)) continue;
      const colour = emphasised.has(body) ? theme.rgb.chosen : colourOf(body);
      putInstance(numbers, INSTANCE * count++, poses, body, colour, 1, 1);
    }
    drawInstances(shape, numbers.subarray(0, INSTANCE * count));
  });
}

// Each foreign world that has the body, as a rim of its colour: of a larger body, what is behind.
function drawGhosts(frame, poses) {
  const shells = new Map(), around = new Map();
  for (const {body, world} of markedAt(frame).ghosts) {
    if (!isThere(frame, body) || world === ownerOf(frame, body)) continue;
    const shape = run.bodies[body].shape, turn = around.get(body) || 0;
    around.set(body, turn + 1);
    if (!shells.has(shape)) shells.set(shape, []);
    const one = Array(INSTANCE);
    putInstance(one, 0, poses, body, hue(worldHue(world), 0.5, 0.8), 1, 1.08 + 0.06 * turn);
    shells.get(shape).push(...one);
  }
  gl.enable(gl.CULL_FACE);
  gl.cullFace(gl.FRONT);
  for (const [shape, numbers] of shells) drawInstances(shape, new Float32Array(numbers));
  gl.disable(gl.CULL_FACE);
}

function drawStatics() {
  const [r, g, b] = theme.rgb.ground;
  run.statics.forEach((still, i) => {
    const numbers = new Float32Array(INSTANCE), dim = 1 - 0.13 * ((i * 0.618034) % 1);
    putInstance(numbers, 0, still.pose, 0, [r * dim, g * dim, b * dim], 1, 1);
    drawInstances(still.shape, numbers);
  });
}

// What is ticked of #marks.
const shownMarks = () => new Set(Array.from(document.querySelectorAll('#marks input:checked'),
                                            box => box.value));

function drawScene(frame, share, emphasised) {
  if (!gl) return;
  const scale = window.devicePixelRatio || 1, poses = posesBetween(frame, share);
  const width = Math.max(1, Math.round(canvas.clientWidth * scale));
  const height = Math.max(1, Math.round(canvas.clientHeight * scale));
  if (canvas.width !== width || canvas.height !== height)
    Object.assign(canvas, {width, height});
  bringTerritoriesTo(frame);
  gl.viewport(0, 0, width, height);
  gl.clearColor(...theme.rgb.sky, 1);
  gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  gl.enable(gl.DEPTH_TEST);
  gl.enable(gl.POLYGON_OFFSET_FILL);  // so that lines on the ground are seen
  gl.polygonOffset(1, 1);
  gl.enable(gl.BLEND);
  gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
  const axes = eyeAxes(), view = projection(axes, width, height), marked = shownMarks();
  gl.useProgram(drawing.solid);
  const place = name => gl.getUniformLocation(drawing.solid, name);
  gl.uniformMatrix4fv(place('view'), false, view);
  gl.uniform3f(place('up'), ...up);
  gl.uniform3f(place('light'), ...unit(add(add(axes.back, axes.right, 0.6), up, 0.8)));
  drawStatics();
  drawBodies(frame, poses, emphasised);
  if (marked.has('ghosts')) drawGhosts(frame, poses);
  gl.disable(gl.POLYGON_OFFSET_FILL);
  const pixel = 2 * fieldOf(width, height) * eye.distance / (height / scale);
  const lines = linesOf(frame, poses, {shown: marked, emphasised, axes, pixel});
  gl.useProgram(drawing.stroke);
  gl.uniformMatrix4fv(gl.getUniformLocation(drawing.stroke, 'view'), false, view);
  gl.uniform2f(gl.getUniformLocation(drawing.stroke, 'pixels'), width / scale, height / scale);
  const before = gl.getUniformLocation(drawing.stroke, 'before');
  gl.uniform3f(before, 0, 0, 0);
  drawLines(lines.borders);
  gl.uniform3f(before, ...scaled(axes.back, 3 * medianRadius));
  drawLines(lines.near);
  gl.disable(gl.DEPTH_TEST);
  drawLines(lines.above);
}

// The nearest body whose bounding sphere the ray meets; -1 if there is none.
function bodyAt(x, y, frame) {
  const axes = eyeAxes(), poses = posesOf(frame);
  const ray = rayThrough(x, y, canvas.clientWidth, canvas.clientHeight, axes);
  let nearest = Infinity, found = -1;
  for (let body = 0; body < BODIES; ++body) {
    if (!isThere(frame, body)) continue;
    const away = add(centreIn(poses, body), axes.place, -1), along = dot(away, ray);
    const aside = Math.hypot(...add(away, ray, -along));
    if (aside < 0.8 * radiusOf(body) && along > 0 && along < nearest)
      [nearest, found] = [along, body];
  }
  return found;
}
