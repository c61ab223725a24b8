
// What is where
const BODIES = run.bodies.length, NUMBERS = 8;
const radii = run.shapes.map(shape => {
  let most = 0;
  for (let i = 0; i < shape.length; i += 6)
    most = Math.max(most, Math.hypot(shape[i], shape[i + 1], shape[i + 2]));
  return most;
});
const radiusOf = body => radii[run.bodies[body].shape];
const isThere = (frame, body) => run.owners[frame * BODIES + body] !== AWAY;
const ownerOf = (frame, body) => run.owners[frame * BODIES + body] & ~RESTING;
const isResting = (frame, body) => isThere(frame, body) &&
  (run.owners[frame * BODIES + body] & RESTING) !== 0;
const placeOfLabel = new Map(run.bodies.map((body, i) => [body.label, i]));
function nameOf(id) {
  if (id < FIRST_STATIC) return `body ${run.bodies[id].label}`;
  return (run.statics[id - FIRST_STATIC] || {name: 'the world'}).name;
}

const HALF = new DataView(new ArrayBuffer(4));
function speedOf(bits) {
  HALF.setUint32(0, bits << 16 >>> 0);
  return HALF.getFloat32(0);
}
// As page_bytes.hpp says: place, orientation, speed.
function unpack(frame, body, out, to) {
  const at = (frame * BODIES + body) * POSE_BYTES, bytes = run.poses;
  for (let k = 0; k < 3; ++k) {
    const bits = bytes.getUint16(at + 3 * k, true) + 65536 * bytes.getUint8(at + 3 * k + 2);
    out[to + k] = run.low[k] + run.size[k] * bits / 0xffffff;
  }
  const packed = bytes.getUint32(at + 9, true), largest = packed >>> 30;
  let sum = 0;
  for (let part = 3, shift = 0; part >= 0; --part) {
    if (part === largest) continue;
    const value = ((packed >>> shift & 1023) / 1023 - 0.5) * Math.SQRT2;
    out[to + 3 + part] = value;
    sum += value * value;
    shift += 10;
  }
  out[to + 3 + largest] = Math.sqrt(Math.max(0, 1 - sum));
  out[to + 7] = speedOf(bytes.getUint16(at + 13, true));
}
function poseOf(frame, body) {
  const out = new Float64Array(NUMBERS);
  unpack(frame, body, out, 0);
  return out;
}

// All bodies of a frame; those of the last few are kept.
const kept = new Map();
function posesOf(frame) {
  let poses = kept.get(frame);
  if (poses) return poses;
  poses = new Float32Array(BODIES * NUMBERS);
  for (let body = 0; body < BODIES; ++body)
    if (isThere(frame, body)) unpack(frame, body, poses, body * NUMBERS);
  if (kept.size > 3) kept.delete(kept.keys().next().value);
  kept.set(frame, poses);
  return poses;
}
// Between a frame and the next, while the page plays; `share` of the way.
const blended = new Float32Array(BODIES * NUMBERS);
function posesBetween(frame, share) {
  const from = posesOf(frame);
  if (share <= 0 || frame === LAST) return from;
  const to = posesOf(frame + 1);
  for (let body = 0; body < BODIES; ++body) {
    const at = body * NUMBERS, both = isThere(frame, body) && isThere(frame + 1, body);
    const near = from[at + 3] * to[at + 3] + from[at + 4] * to[at + 4] +
      from[at + 5] * to[at + 5] + from[at + 6] * to[at + 6] < 0 ? -1 : 1;
    const part = both ? share : 0;
    for (let k = 0; k < NUMBERS; ++k) {
      const end = k > 2 && k < 7 ? near * to[at + k] : to[at + k];
      blended[at + k] = from[at + k] + part * (end - from[at + k]);
    }
  }
  return blended;
}

// Where bodies are at the beginning, halfway and at the end; their middle, along each axis that of
// nine in ten.
const places = [];
for (const frame of [0, LAST >> 1, LAST])
  for (let body = 0; body < BODIES; ++body)
    if (isThere(frame, body)) places.push(Array.from(poseOf(frame, body).subarray(0, 3)));
function middleOf(axis) {
  const at = places.map(place => place[axis]).sort((a, b) => a - b);
  return 0.5 * ((at[Math.floor(0.05 * at.length)] || 0) +
                (at[Math.ceil(0.95 * at.length) - 1] || 0));
}
// The eye so far away that they are seen; 19 in 20 of them, if others are far off.
function lookAtAll(width, height) {
  const axes = eyeAxes(), field = fieldOf(width, height);
  const largest = Math.max(...run.bodies.slice(0, 1000).map(body => radii[body.shape]), 1e-9);
  const needed = places.map(place => {
    const way = add(place, eye.target, -1);
    return dot(way, axes.back) + Math.max(Math.abs(dot(way, axes.right)) * height / width,
                                          Math.abs(dot(way, axes.above))) / field;
  }).sort((a, b) => a - b);
  const most = needed[Math.floor(0.95 * needed.length)] || 0;
  eye.distance = 1.1 * (Math.min(needed[needed.length - 1] || 0, 1.6 * most) + 2.5 * largest);
}
eye.target = [0, 1, 2].map(middleOf);

let fastest = 0;
for (let i = 0; i < run.owners.length; ++i)
  if (run.owners[i] !== AWAY)
    fastest = Math.max(fastest, speedOf(run.poses.getUint16(i * POSE_BYTES + 13, true)));

// The frame with contacts and ghosts that is nearest to `frame`.
function markedAt(frame) {
  return marks.frames[within(0, Math.round(frame / marks.every), marks.frames.length - 1)] ||
    {frame: 0, contacts: [], ghosts: []};
}
const jointsAt = frame => marks.joints.filter(joint => joint.brokenFrom > frame &&
  isThere(frame, joint.a) && (joint.b === WORLD_BODY || isThere(frame, joint.b)));

// Bodies that contacts and joints hold together: the least body of each one's island, and the
// islands whose bodies have several owners.
let islandsKept = {marked: null, frame: -1};
function islandsAt(frame) {
  const marked = markedAt(frame);
  if (islandsKept.marked === marked && islandsKept.frame === frame) return islandsKept;
  const root = Int32Array.from({length: BODIES}, (_, body) => body);
  const find = body => {
    while (root[body] !== body) body = root[body] = root[root[body]];
    return body;
  };
  const join = (a, b) => {
    if (b >= FIRST_STATIC) return;
    const [x, y] = [find(a), find(b)];
    root[Math.max(x, y)] = Math.min(x, y);
  };
  for (const contact of marked.contacts) join(contact.a, contact.b);
  for (const joint of jointsAt(frame)) join(joint.a, joint.b);
  const mixed = new Set();
  for (let body = 0; body < BODIES; ++body)
    if (isThere(frame, body) && find(body) !== body &&
        ownerOf(frame, body) !== ownerOf(frame, find(body))) mixed.add(find(body));
  islandsKept = {marked, frame, of: Int32Array.from(root, find), mixed};
  return islandsKept;
}
