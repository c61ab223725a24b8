
// Vectors and turns
const add = (a, b, s = 1) => [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
                         a[0] * b[1] - a[1] * b[0]];
const scaled = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
const unit = a => scaled(a, 1 / (Math.hypot(...a) || 1));
// `pose`: x, y, z and w, x, y, z from `at` on.
function placed(pose, at, v) {
  const axis = [pose[at + 4], pose[at + 5], pose[at + 6]];
  const around = add(cross(axis, v), v, pose[at + 3]);
  return add(add([pose[at], pose[at + 1], pose[at + 2]], v), cross(axis, around), 2);
}
const within = (low, x, high) => Math.max(low, Math.min(high, x));

// The first place in ascending `values` that holds more than `x`.
function placeAfter(values, x) {
  let low = 0, high = values.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (values[middle] <= x) low = middle + 1; else high = middle;
  }
  return low;
}

// The eye: at `distance` from `target`, up being against gravity.
const FIELD = 0.45;  // tangent of half the lesser field of view
const up = run.up;
const east = unit(Math.abs(up[0]) < 0.9 ? add([1, 0, 0], up, -up[0]) : add([0, 1, 0], up, -up[1]));
const north = cross(up, east);
const eye = {target: [0, 0, 0], distance: 1, azimuth: -1.1, height: 0.42};

function eyeAxes() {
  const level = add(scaled(east, Math.cos(eye.azimuth)), north, Math.sin(eye.azimuth));
  const back = add(scaled(level, Math.cos(eye.height)), up, Math.sin(eye.height));
  const right = unit(cross(up, back));
  return {back, right, above: cross(back, right), place: add(eye.target, back, eye.distance)};
}
// What is as wide as high is seen whole on narrow screens, too.
const fieldOf = (width, height) => FIELD * Math.max(1, height / width);

function projection(axes, width, height) {
  const near = eye.distance / 100, far = eye.distance * 100, f = 1 / fieldOf(width, height);
  const {right, above, back, place} = axes, aspect = width / height;
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
// The way from the eye through a point of the canvas.
function rayThrough(x, y, width, height, axes) {
  const field = fieldOf(width, height);
  const across = field * (2 * x - width) / height, above = field * (height - 2 * y) / height;
  return unit(add(add(scaled(axes.back, -1), axes.right, across), axes.above, above));
}

// Colours, as three numbers between 0 and 1
function hue(h, light = 0.55, strength = 0.55) {
  const channel = n => {
    const k = (n + h * 12) % 12;
    return light - strength * Math.min(light, 1 - light) *
      Math.max(-1, Math.min(k - 3, 9 - k, 1));
  };
  return [channel(0), channel(8), channel(4)];
}
const css = colour => `rgb(${colour.map(c => Math.round(255 * c)).join(' ')})`;
const worldHue = world => (0.58 + world * 0.618034) % 1;
// Neighbouring bodies of one world differ a little.
const worldColour = (world, body) =>
  hue(worldHue(world), (world % 2 ? 0.48 : 0.58) + 0.08 * ((body * 0.618034) % 1));
const worldSwatch = world => css(hue(worldHue(world), world % 2 ? 0.52 : 0.62));

// The colours of viewer.css, which change with the scheme.
let theme = {};
function readTheme() {
  const style = getComputedStyle(document.body);
  theme = {};
  for (const name of ['sky', 'ground', 'ink', 'faint', 'line', 'panel', 'lane', 'committed',
                      'again', 'undone', 'repeated', 'open', 'gvt', 'cursor', 'contact', 'joint',
                      'mixed', 'border', 'chosen'])
    theme[name] = style.getPropertyValue(`--${name}`).trim();
  theme.rgb = Object.fromEntries(Object.entries(theme).map(([name, text]) =>
    [name, [1, 3, 5].map(i => parseInt(text.slice(i, i + 2), 16) / 255)]));
}
