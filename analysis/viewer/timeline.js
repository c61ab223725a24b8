
// What all worlds did, over the executor's clock or over virtual time: the axis is shared with the
// plots.
const axis = {
  wall: timeline !== null,
  from: 0,
  to: 1
};
const wholeAxis = () => axis.wall ? [0, timeline.end]
                                  : [stepOf(0), Math.max(stepOf(0) + 1, stepOf(LAST))];
const cursorOnAxis = () => axis.wall ? cursor.wall : stepOf(cursor.frame);
const toAxis = value => axis.wall ? toWall(value) : toStep(Math.round(value));
// A step (of states), or a time on the clock, where the axis is the other.
const stepOnAxis = step => axis.wall ? wallOfStep(step) : step;
const wallOnAxis = wall => axis.wall ? wall : stepAtWall(wall);

function setAxis(isWall) {
  axis.wall = isWall && timeline !== null;
  [axis.from, axis.to] = wholeAxis();
  byId('axis').value = axis.wall ? 'wall' : 'virtual';
  pictures.clear();
  changedAnything();
}
function zoomAxis(factor, around) {
  const [first, last] = wholeAxis(), least = Math.min(axis.wall ? 100 : 2, last - first);
  const width = within(least, (axis.to - axis.from) * factor, last - first);
  const share = (around - axis.from) / (axis.to - axis.from);
  axis.from = within(first, around - share * width, last - width);
  axis.to = axis.from + width;
  pictures.clear();
  changedAnything();
}
function panAxis(by) {
  const width = axis.to - axis.from, [first, last] = wholeAxis();
  axis.from = within(first, axis.from + by, last - width);
  axis.to = axis.from + width;
  pictures.clear();
  changedAnything();
}

const lanes = byId('lanes'), HEAD = 20, GUTTER = 62;  // of the lanes, for names
const leftOf = element => element === lanes ? GUTTER : 46;
const WORLDS = timeline ? timeline.worlds : 0;
let laneHeight = 14;
const laneTop = world => HEAD + world * laneHeight;
const widthOf = element => element.clientWidth - leftOf(element) - 8;
const toX = (value, element) =>
    leftOf(element) + (value - axis.from) / (axis.to - axis.from) * widthOf(element);
const toValue = (x, element) =>
    axis.from + (x - leftOf(element)) / widthOf(element) * (axis.to - axis.from);

// Ready to draw, in pixels of the page. Drawn by the processor: many small areas are no work for a
// graphics card, and pictures are kept.
const penOf = element => element.getContext('2d', {willReadFrequently: true});
function paper(element, height) {
  const scale = window.devicePixelRatio || 1, width = element.clientWidth;
  element.style.height = `${height}px`;
  const wanted = [Math.round(width * scale), Math.round(height * scale)];
  if (element.width !== wanted[0]) element.width = wanted[0];
  if (element.height !== wanted[1]) element.height = wanted[1];
  const pen = penOf(element);
  pen.setTransform(scale, 0, 0, scale, 0, 0);
  pen.clearRect(0, 0, width, height);
  pen.font = '11px system-ui, sans-serif';
  pen.textBaseline = 'middle';
  return pen;
}

// What does not move with the cursor is drawn once, and kept as an image, until the axis changes.
const pictures = new Map();
function onPicture(element, height, draw) {
  const size = `${element.clientWidth} ${height} ${window.devicePixelRatio}`;
  let kept = pictures.get(element);
  if (!kept || kept.size !== size) {
    draw(paper(element, height), element, height);
    kept = {size, image: document.createElement('canvas')};
    kept.image.width = element.width;
    kept.image.height = element.height;
    if (element.width > 0) penOf(kept.image).drawImage(element, 0, 0);
    pictures.set(element, kept);
  }
  const pen = paper(element, height);
  if (element.width > 0) pen.drawImage(kept.image, 0, 0, element.clientWidth, height);
  return pen;
}

const timeWords = ns => {
  const [unit, size] = ns >= 1e9 ? ['s', 1e9] : ns >= 1e6 || ns === 0 ? ['ms', 1e6] : ['µs', 1e3];
  return `${Number((ns / size).toPrecision(4))} ${unit}`;
};
const axisWords = value => axis.wall ? timeWords(value) : `step ${Math.round(value)}`;

// Round values, some 90 pixels apart.
function ticksOf(element) {
  const rough = (axis.to - axis.from) * 90 / Math.max(90, widthOf(element));
  const ten = Math.pow(10, Math.floor(Math.log10(rough)));
  const step = Math.max(axis.wall ? 0 : 1, [1, 2, 5, 10].map(n => n * ten).find(s => s >= rough));
  const ticks = [];
  for (let tick = Math.ceil(axis.from / step) * step; tick <= axis.to; tick += step)
    ticks.push(tick);
  return ticks;
}

const FATES = ['committed', 'again', 'undone', 'repeated', 'open'];
const ROLLED_BACK = 2, PHASES = 8;
// Where a bar lies on the axis.
function spanOf(i) {
  const {bars} = timeline;
  if (axis.wall) return [bars.began[i], bars.ended[i]];
  const single = timeline.stepsABar === 0;
  return [
    bars.step[i] + (single ? bars.phase[i] / PHASES : 0),
    single ? bars.step[i] + (bars.phase[i] + 1) / PHASES : bars.lastStep[i] + 1
  ];
}

// Bars of one fate; those that fall on one another, or lie side by side, are drawn as one.
function drawBars(pen, element, fate, top, height) {
  const {bars} = timeline, right = element.clientWidth, left = leftOf(element);
  const scale = widthOf(element) / (axis.to - axis.from);
  let lane = -1, begun = 0, end = -1, alpha = 0;
  const flush = () => {
    if (end < 0) return;
    pen.globalAlpha = alpha;
    pen.fillRect(begun, laneTop(lane) + top, end - begun - (end - begun > 3 ? 0.5 : 0), height);
  };
  pen.fillStyle = theme[FATES[fate]];
  for (let i = 0; i < bars.world.length; ++i) {
    if (bars.fate[i] !== fate) continue;
    const [from, to] = spanOf(i);
    if (to < axis.from || from > axis.to) continue;
    const x = Math.max(left, left + (from - axis.from) * scale);
    const until = Math.min(right, Math.max(left + (to - axis.from) * scale, x + 0.8));
    const paler = axis.wall ? 0.4 + 0.2 * Math.round(3 * bars.busy[i] / 255) : 0.8;
    const joins = bars.world[i] === lane && x <= end + 0.3 && x >= begun - 0.5 &&
        (paler === alpha || until - x < 2) && until - x < 3;
    if (joins) {
      end = Math.max(end, until);
      continue;
    }
    flush();
    [lane, begun, end, alpha] = [bars.world[i], x, until, paler];
  }
  flush();
  pen.globalAlpha = 1;
}

// How full each world's buffer is: the lane's height is all of it.
function drawFill(pen, element) {
  const {samples, buffer, end} = timeline, count = samples.executed.length;
  if (!axis.wall || laneHeight < 9) return;
  pen.strokeStyle = theme.ink;
  pen.globalAlpha = 0.75;
  for (let world = 0; world < WORLDS; ++world) {
    pen.beginPath();
    for (let i = 0; i < count; ++i) {
      const ahead = samples.reached[i * WORLDS + world] + 1 - samples.committed[i];
      const share = within(0, ahead / buffer, 1), bottom = laneTop(world) + laneHeight - 1.5;
      const x = toX((i + 1) / count * end, element);
      if (x >= GUTTER) pen.lineTo(x, bottom - share * (laneHeight - 3));
    }
    pen.stroke();
  }
  pen.globalAlpha = 1;
}

// GVT as it passes steps; over virtual time, when it did.
function drawGvt(pen, element) {
  const {steps, at} = timeline.commits;
  let painted = -1e9;
  pen.fillStyle = theme.gvt;
  pen.globalAlpha = 0.9;
  for (let i = 0; i < steps.length; ++i) {
    const x = toX(axis.wall ? at[i] : steps[i], element);
    if (x < GUTTER || x > element.clientWidth - 8 || x < painted + 1) continue;
    pen.fillRect(x - 0.5, HEAD - 5, 1, 4);
    painted = x;
  }
  pen.globalAlpha = 1;
  pen.fillStyle = theme.faint;
  pen.fillText('GVT', 13, 9);
  for (const tick of ticksOf(element)) {
    const words = axis.wall ? `step ${Math.floor(stepAtWall(tick))}` : timeWords(wallOfStep(tick));
    const x = toX(tick, element);
    if (x < element.clientWidth - 50) pen.fillText(words, x + 2, 7);
  }
}

function drawTimeline(pen, element, height) {
  pen.fillStyle = theme.lane;
  const gap = laneHeight > 5 ? 1 : 0;
  for (let world = 0; world < WORLDS; ++world)
    pen.fillRect(GUTTER, laneTop(world), widthOf(element), laneHeight - gap);
  const body = laneHeight - gap, half = axis.wall ? 0 : Math.round(body * 0.45);
  for (const fate of [3, 4, 0, 1]) drawBars(pen, element, fate, half, body - half);
  drawBars(pen, element, ROLLED_BACK, 0, axis.wall ? body : half);
  pen.fillStyle = theme.faint;
  const every = Math.ceil(13 / laneHeight);
  for (let world = 0; world < WORLDS; world += every) {
    pen.fillStyle = worldSwatch(world);
    pen.fillRect(4, laneTop(world) + 1, 6, Math.max(1, laneHeight * every - 3));
    pen.fillStyle = theme.ink;
    pen.fillText(`world ${world}`, 13, laneTop(world) + Math.min(laneHeight * every, 14) / 2);
  }
  drawFill(pen, element);
  drawGvt(pen, element);
  pen.fillStyle = theme.faint;
  for (const tick of ticksOf(element)) {
    const x = toX(tick, element), words = axisWords(tick);
    pen.fillRect(x, HEAD, 1, 3);
    if (x < element.clientWidth - 60) pen.fillText(words, x + 2, height - 7);
  }
  drawRollbackMarks(pen, element);
}

const rollbackX = (rollback, element) => toX(axis.wall ? rollback.at : rollback.changedAt, element);
// A notch each; where many fall on one another, one, and of many a smaller one.
function drawRollbackMarks(pen, element) {
  const {rollbacks} = timeline, taken = new Set(), size = within(2.5, laneHeight / 4, 5);
  const many = rollbacks.length * (axis.to - axis.from) >
    WORLDS * widthOf(element) / 30 * (wholeAxis()[1] - wholeAxis()[0]);
  pen.fillStyle = theme.undone;
  pen.strokeStyle = theme.panel;
  pen.beginPath();
  for (const rollback of rollbacks) {
    const x = rollbackX(rollback, element), top = laneTop(rollback.world);
    const key = Math.round(x / (many ? 12 : 7)) * 65536 + rollback.world;
    if (x < GUTTER || x > element.clientWidth - 6 || taken.has(key)) continue;
    taken.add(key);
    if (many) {
      pen.rect(Math.round(x) - 2, top, 4, 4);
      continue;
    }
    pen.moveTo(x - size, top);
    pen.lineTo(x + size, top);
    pen.lineTo(x, top + 1.7 * size);
    pen.closePath();
  }
  pen.fill();
  pen.stroke();
}

const laneMiddle = world => laneTop(world) + laneHeight / 2;
function drawMessage(pen, element, rollback, arrow) {
  const outside = arrow.from === NOBODY;
  const [x0, y0] =
      [toX(axis.wall ? arrow.sent : arrow.sentAt, element), outside ? 4 : laneMiddle(arrow.from)];
  const [x1, y1] =
      [toX(axis.wall ? arrow.arrived : rollback.changedAt, element), laneMiddle(rollback.world)];
  const way = Math.atan2(y1 - y0, x1 - x0 || 1e-9);
  pen.setLineDash(arrow.anti ? [4, 3] : []);
  pen.beginPath();
  pen.moveTo(x0, y0);
  pen.lineTo(x1, y1);
  pen.stroke();
  pen.setLineDash([]);
  pen.beginPath();
  pen.moveTo(x1, y1);
  for (const turn of [2.65, -2.65])
    pen.lineTo(x1 + 9 * Math.cos(way + turn), y1 + 9 * Math.sin(way + turn));
  pen.closePath();
  pen.fill();
  pen.beginPath();
  pen.arc(x0, y0, 3, 0, 7);
  pen.fill();
}
// What the rollback undid is underlined; the messages that led to it are arrows.
function drawChosenRollback(pen, element) {
  const rollback = timeline.rollbacks[chosen.rollback], {bars} = timeline;
  pen.strokeStyle = pen.fillStyle = theme.ink;
  let end = -1;
  for (let i = 0; i < bars.world.length; ++i) {
    if (bars.rollback[i] !== chosen.rollback) continue;
    const [from, to] = spanOf(i), x = Math.max(toX(from, element), end);
    end = Math.max(toX(to, element), x + 1);
    pen.fillRect(x, laneTop(bars.world[i]) + laneHeight - 4, end - x, 3);
  }
  pen.lineWidth = 2;
  for (const arrow of rollback.arrows) drawMessage(pen, element, rollback, arrow);
  const x = rollbackX(rollback, element);
  pen.strokeStyle = theme.cursor;
  pen.beginPath();
  pen.arc(x, laneTop(rollback.world) + 4, 8, 0, 7);
  pen.stroke();
  pen.lineWidth = 1;
}

// How far each world had come when the cursor's state was committed.
function drawReached(pen, element) {
  const {samples, end} = timeline, count = samples.executed.length;
  const i = within(0, Math.floor(cursor.wall / end * count), count - 1);
  pen.fillStyle = theme.ink;
  for (let world = 0; world < WORLDS; ++world) {
    const x = toX(samples.reached[i * WORLDS + world] + 1, element);
    if (x >= GUTTER) pen.fillRect(x - 1, laneTop(world), 2, laneHeight - 1);
  }
}

function drawCursor(pen, element, top, bottom) {
  const x = toX(cursorOnAxis(), element);
  if (x < leftOf(element) - 1 || x > element.clientWidth) return;
  pen.fillStyle = theme.cursor;
  pen.fillRect(Math.round(x) - 1, top, 2, bottom - top);
}

function showTimeline() {
  if (!timeline) return;
  laneHeight = within(3, Math.floor(150 / WORLDS), 22);
  const height = HEAD + WORLDS * laneHeight + 15;
  const pen = onPicture(lanes, height, drawTimeline);
  pen.save();
  pen.beginPath();
  pen.rect(GUTTER - 1, 0, lanes.clientWidth, height);
  pen.clip();
  if (!axis.wall) drawReached(pen, lanes);
  if (chosen.rollback >= 0) drawChosenRollback(pen, lanes);
  drawCursor(pen, lanes, HEAD - 4, height - 14);
  pen.restore();
  lanes.dataset.cursor = toX(cursorOnAxis(), lanes).toFixed(1);
}

// The nearest rollback, by its notch or by what it undid; -1 if there is none.
function rollbackAt(x, y, reach) {
  const world = Math.floor((y - HEAD) / laneHeight);
  let nearest = reach, found = -1;
  timeline.rollbacks.forEach((rollback, i) => {
    const away = Math.hypot(
        rollbackX(rollback, lanes) - x,
        Math.max(0, Math.abs(world - rollback.world) - 0.4) * laneHeight);
    if (away < nearest) [nearest, found] = [away, i];
  });
  if (found >= 0) return found;
  const bar = barAt(x, y);
  return bar >= 0 && timeline.bars.rollback[bar] !== NOBODY ? timeline.bars.rollback[bar] : -1;
}
function barAt(x, y) {
  const {bars} = timeline, world = Math.floor((y - HEAD) / laneHeight), value = toValue(x, lanes);
  const slack = (axis.to - axis.from) / widthOf(lanes);
  let found = -1;
  for (let i = 0; i < bars.world.length; ++i) {
    if (bars.world[i] !== world) continue;
    const [from, to] = spanOf(i);
    if (value >= from - slack && value <= to + slack && (found < 0 || bars.fate[i] === ROLLED_BACK))
      found = i;
  }
  return found;
}
