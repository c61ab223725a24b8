
// Lines that are drawn over the bodies: a list of numbers, 11 a line: two ends, colour, opacity,
// and the width in pixels.
const LINE = 11;

// Territories: who owns each cell in the frame that is shown, with a layer of nobody's around.
const wide = run.grid.cells.map(n => n + 2), strides = [wide[1] * wide[2], wide[2], 1];
const held = new Int32Array(wide[0] * wide[1] * wide[2]).fill(-1);
function placeOfCell(cell) {
  const [, deep, high] = run.grid.cells, column = Math.floor(cell / high);
  return (Math.floor(column / deep) + 1) * strides[0] + (column % deep + 1) * strides[1] +
    cell % high + 1;
}
run.cellOwners.forEach((owner, cell) => { held[placeOfCell(cell)] = owner; });
let changed = 0;  // how many of the changes are in `held`

function bringTerritoriesTo(frame) {
  const before = changed;
  for (; changed < run.changes.length && run.changes[changed].frame <= frame; ++changed)
    held[placeOfCell(run.changes[changed].cell)] = run.changes[changed].to;
  for (; changed > 0 && run.changes[changed - 1].frame > frame; --changed)
    held[placeOfCell(run.changes[changed - 1].cell)] = run.changes[changed - 1].from;
  if (changed !== before) borderKept = null;
}

// The level edges of borders; an edge between two faces in one plane is none.
let borderKept = null;
function borderEdges() {
  if (borderKept) return borderKept;
  const edges = [], apart = (a, b) => a >= 0 && b >= 0 && a !== b;
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
      const end = add(run.grid.origin, cell, run.grid.size);
      edges.push([end, add(end, [0, 1, 2].map(k => k === axis ? run.grid.size : 0))]);
    }
  }
  return borderKept = edges;
}

class Lines {
  constructor() { this.numbers = []; }
  add(from, to, colour, opacity, width) {
    this.numbers.push(...from, ...to, ...colour, opacity, width);
  }
  // With a head in the plane of the screen.
  arrow(from, to, colour, width, back) {
    this.add(from, to, colour, 1, width);
    const way = add(to, from, -1), side = scaled(unit(cross(way, back)), Math.hypot(...way));
    for (const turn of [0.13, -0.13])
      this.add(to, add(add(from, way, 0.75), side, turn), colour, 1, width);
  }
}

const median = values => values.sort((a, b) => a - b)[values.length >> 1] || 1;
const medianRadius = median(run.bodies.slice(0, 500).map(body => radii[body.shape]));

// The median force is drawn as long as a median radius; lengths grow with the square root of
// forces, up to some of them.
let forceScaleKept = null;
function forceScale() {
  if (forceScaleKept) return forceScaleKept;
  const forces = [];
  for (const frame of marks.frames)
    for (let i = 0; i < frame.contacts.length; i += 7) forces.push(frame.contacts[i].normal);
  return forceScaleKept = {factor: medianRadius / Math.sqrt(median(forces)),
                           most: 4 * medianRadius};
}

// Contacts as they are known, of another frame perhaps: each has gone along with its first body, but
// not turned with it, for where a body rolls the contact stays below.
function contactsIn(frame, poses) {
  const marked = markedAt(frame), then = posesOf(marked.frame);
  return marked.contacts
    .filter(({a, b}) => isThere(frame, a) && (b >= FIRST_STATIC || isThere(frame, b)))
    .map(contact => ({...contact, point: add(contact.point, add(centreIn(poses, contact.a),
                                                                centreIn(then, contact.a), -1))}));
}

const MOST_ARROWS = 6000;
// Thinner where bodies are small on the screen.
function addContacts(lines, frame, poses, back, pixel) {
  const contacts = contactsIn(frame, poses), {factor, most} = forceScale();
  const width = within(0.5, most / pixel / 30, 1.6);
  const every = Math.ceil(contacts.length / MOST_ARROWS);
  for (let i = 0; i < contacts.length; i += every) {
    const {point, force} = contacts[i], size = Math.hypot(...force);
    if (size === 0) continue;
    const length = Math.min(Math.sqrt(size) * factor, most);
    lines.arrow(point, add(point, force, length / size), theme.rgb.contact, width, back);
  }
}

function centreIn(poses, body) {
  const at = body * NUMBERS;
  return [poses[at], poses[at + 1], poses[at + 2]];
}

function addJoints(lines, frame, poses) {
  const colour = theme.rgb.joint;
  for (const joint of jointsAt(frame)) {
    const a = placed(poses, joint.a * NUMBERS, joint.anchorA);
    const b = joint.b === WORLD_BODY ? joint.anchorB
                                     : placed(poses, joint.b * NUMBERS, joint.anchorB);
    lines.add(centreIn(poses, joint.a), a, colour, 0.9, 2);
    lines.add(a, b, colour, 1, 3);
    if (joint.b !== WORLD_BODY) lines.add(b, centreIn(poses, joint.b), colour, 0.9, 2);
  }
}

// Between bodies that touch, or that a joint holds, in islands of several worlds.
function addMixed(lines, frame, poses) {
  const {of, mixed} = islandsAt(frame);
  if (mixed.size === 0) return;
  const pairs = new Set(), colour = theme.rgb.mixed;
  const link = (a, b) => {
    if (b >= FIRST_STATIC || !mixed.has(of[a]) || pairs.has(a * BODIES + b)) return;
    pairs.add(a * BODIES + b);
    const crosses = ownerOf(frame, a) !== ownerOf(frame, b);
    lines.add(centreIn(poses, a), centreIn(poses, b), colour, crosses ? 1 : 0.65,
              crosses ? 4.5 : 2);
  };
  for (const contact of markedAt(frame).contacts) link(contact.a, contact.b);
  for (const joint of jointsAt(frame)) link(joint.a, joint.b);
}

// A ring around each, large enough to be found.
function addRings(lines, frame, poses, bodies, axes, pixel) {
  for (const body of bodies) {
    if (!isThere(frame, body)) continue;
    const centre = centreIn(poses, body), size = Math.max(1.5 * radiusOf(body), 9 * pixel);
    const at = turn => add(add(centre, axes.right, size * Math.cos(turn)), axes.above,
                           size * Math.sin(turn));
    for (const [colour, width] of [[theme.rgb.ink, 4], [theme.rgb.chosen, 2]])
      for (let i = 0; i < 20; ++i)
        lines.add(at(i * Math.PI / 10), at((i + 1) * Math.PI / 10), colour, 1, width);
  }
}

// Each line for the frame that is shown: borders; what is seen through the bodies that it lies in;
// and what nothing hides. `pixel`: how long it is where the eye looks.
function linesOf(frame, poses, {shown, emphasised, axes, pixel}) {
  const borders = new Lines(), near = new Lines(), above = new Lines();
  if (shown.has('borders'))
    for (const [from, to] of borderEdges()) borders.add(from, to, theme.rgb.border, 0.8, 1.5);
  if (shown.has('contacts')) addContacts(near, frame, poses, axes.back, pixel);
  if (shown.has('joints')) addJoints(near, frame, poses);
  if (shown.has('mixed')) addMixed(near, frame, poses);
  addRings(above, frame, poses, emphasised, axes, pixel);
  return {borders: borders.numbers, near: near.numbers, above: above.numbers};
}
