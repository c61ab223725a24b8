
// Pointer, keys, and the beginning

// A drag over a panel moves the cursor; two fingers or the wheel zoom, shift moves along.
function followPointer(panel, onClick) {
  const down = new Map();
  let moved = 0;
  const place = event => event.clientX - panel.getBoundingClientRect().left;
  const scrub = event => { play(false); toAxis(toValue(place(event), panel)); };
  panel.addEventListener('pointerdown', event => {
    if (event.button > 0) return;
    down.set(event.pointerId, event);
    moved = 0;
    panel.setPointerCapture(event.pointerId);
  });
  panel.addEventListener('pointermove', event => {
    const before = down.get(event.pointerId);
    if (!before) return;
    const others = [...down.values()].filter(other => other.pointerId !== event.pointerId);
    moved += Math.abs(event.clientX - before.clientX);
    down.set(event.pointerId, event);
    if (others.length === 1) {
      const away = one => Math.max(20, Math.abs(one.clientX - others[0].clientX));
      zoomAxis(away(before) / away(event), toValue(place(event), panel));
    } else if (event.shiftKey) {
      panAxis((before.clientX - event.clientX) / widthOf(panel) * (axis.to - axis.from));
    } else if (moved > 3) {
      scrub(event);
    }
  });
  panel.addEventListener('pointerup', event => {
    const clicks = down.delete(event.pointerId) && moved <= 3 && down.size === 0;
    if (clicks && !(onClick && onClick(event))) scrub(event);
  });
  panel.addEventListener('pointercancel', event => down.delete(event.pointerId));
  panel.addEventListener('wheel', event => {
    event.preventDefault();
    if (Math.abs(event.deltaX) > Math.abs(event.deltaY))
      panAxis(event.deltaX / widthOf(panel) * (axis.to - axis.from));
    else zoomAxis(Math.exp(event.deltaY * 0.002), toValue(place(event), panel));
  }, {passive: false});
}

function clickTimeline(event) {
  const box = lanes.getBoundingClientRect(), reach = event.pointerType === 'touch' ? 18 : 9;
  const found = rollbackAt(event.clientX - box.left, event.clientY - box.top, reach);
  if (found < 0) return false;
  chooseRollback(found);
  return true;
}
// Tells what lies under the mouse.
function hoverTimeline(event) {
  const box = lanes.getBoundingClientRect();
  const bar = barAt(event.clientX - box.left, event.clientY - box.top), {bars} = timeline;
  if (bar < 0) return byId('hover').textContent = '';
  const steps = bars.step[bar] === bars.lastStep[bar] ? `step ${bars.step[bar]}`
    : `steps ${bars.step[bar]} to ${bars.lastStep[bar]}`;
  const phase = ['step', '', 'border traversal', 'pairs', 'sync', 'split', 'solve', 'finish'];
  const fate = ['committed', 'committed again', 'rolled back', 'repeated', 'open'];
  byId('hover').textContent = `world ${bars.world[bar]}, ${steps}` +
    (timeline.stepsABar === 0 ? `, ${phase[bars.phase[bar]]}` : '') +
    `, ${timeWords(bars.ended[bar] - bars.began[bar])} from ${timeWords(bars.began[bar])}, ` +
    fate[bars.fate[bar]];
}

// The scene: a drag turns, with shift, another button or two fingers it moves; wheel and pinch
// come nearer; a click chooses.
const fingers = new Map();
let travelled = 0;
function moveEye(dx, dy, pans) {
  if (!pans) {
    eye.azimuth -= dx * 0.008;
    eye.height = within(-1.5, eye.height + dy * 0.008, 1.5);
    return;
  }
  const axes = eyeAxes(), height = canvas.clientHeight;
  const step = 2 * fieldOf(canvas.clientWidth, height) * eye.distance / height;
  eye.target = add(add(eye.target, axes.right, -dx * step), axes.above, dy * step);
}
canvas.addEventListener('pointerdown', event => {
  fingers.set(event.pointerId, {x: event.clientX, y: event.clientY,
                                pans: event.button > 0 || event.shiftKey});
  travelled = fingers.size > 1 ? 9 : 0;
  canvas.setPointerCapture(event.pointerId);
});
canvas.addEventListener('pointermove', event => {
  const finger = fingers.get(event.pointerId);
  if (!finger) return;
  const dx = event.clientX - finger.x, dy = event.clientY - finger.y;
  travelled += Math.abs(dx) + Math.abs(dy);
  const other = [...fingers.entries()].find(([id]) => id !== event.pointerId);
  if (other) {
    const away = (x, y) => Math.max(10, Math.hypot(x - other[1].x, y - other[1].y));
    eye.distance *= away(finger.x, finger.y) / away(event.clientX, event.clientY);
    moveEye(dx / 2, dy / 2, true);
  } else {
    moveEye(dx, dy, finger.pans);
  }
  Object.assign(finger, {x: event.clientX, y: event.clientY});
  changedAnything();
});
canvas.addEventListener('pointerup', event => {
  if (fingers.delete(event.pointerId) && travelled < 4) {
    const box = canvas.getBoundingClientRect();
    chooseBody(bodyAt(event.clientX - box.left, event.clientY - box.top, cursor.frame), false);
  }
});
canvas.addEventListener('pointercancel', event => fingers.delete(event.pointerId));
canvas.addEventListener('contextmenu', event => event.preventDefault());
canvas.addEventListener('wheel', event => {
  event.preventDefault();
  eye.distance *= Math.exp(event.deltaY * 0.001);
  changedAnything();
}, {passive: false});

// Keys belong to what has the focus, and only else to the page.
const KEYS = {
  ' ': () => play(!player.on),
  ArrowRight: event => toFrame(cursor.frame + (event.shiftKey ? 10 : 1)),
  ArrowLeft: event => toFrame(cursor.frame - (event.shiftKey ? 10 : 1)),
  Home: () => toFrame(0),
  End: () => toFrame(LAST),
  n: () => stepRollback(1),
  p: () => stepRollback(-1),
  f: () => chooseBody(chosen.body, true),
  '/': () => byId('search').focus(),
  Escape: () => { chosen.rollback = chosen.body = -1; changedAnything(); },
};
document.addEventListener('keydown', event => {
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  const focused = event.target;
  if (focused.matches('input:not([type=checkbox]), select, textarea')) {
    if (event.key === 'Escape') focused.blur();
    return;
  }
  if (focused.matches('button, summary, a, input') && [' ', 'Enter'].includes(event.key)) return;
  const act = KEYS[event.key];
  if (!act) return;
  event.preventDefault();
  act(event);
});

function setScheme(scheme) {
  if (scheme === 'auto') delete document.documentElement.dataset.scheme;
  else document.documentElement.dataset.scheme = scheme;
  byId('scheme').value = scheme;
  readTheme();
  showLegend();
  pictures.clear();
  changedAnything();
}

function showAll() {
  drawScene(cursor.frame, cursor.share,
            new Set([...bodiesOfRollback(), ...(chosen.body < 0 ? [] : [chosen.body])]));
  showTimeline();
  showPlots();
  showClock();
  showMarked();
  showBody();
  showRollback();
}

function listen() {
  byId('play').onclick = () => play(!player.on);
  byId('frame').oninput = event => { play(false); toFrame(Number(event.target.value)); };
  byId('colour').onchange = () => { showLegend(); changedAnything(); };
  byId('marks').onchange = changedAnything;
  byId('axis').onchange = event => setAxis(event.target.value === 'wall');
  byId('zoom-out').onclick = () => setAxis(axis.wall);
  byId('scheme').onchange = event => setScheme(event.target.value);
  byId('search').oninput = search;
  byId('search').onkeydown = event => {
    const [first] = event.key === 'Enter' ? search() : [];
    if (first !== undefined) chooseBody(first, true);
  };
  byId('earlier').onclick = () => stepRollback(-1);
  byId('later').onclick = () => stepRollback(1);
  for (const name of ['rollback', 'body'])
    byId(`close-${name}`).onclick = () => { chosen[name] = -1; changedAnything(); };
  matchMedia('(prefers-color-scheme: dark)').onchange = () => setScheme(byId('scheme').value);
  new ResizeObserver(changedAnything).observe(document.body);
  window.onresize = changedAnything;
}

// page.html#step=120&colour=speed&azimuth=-1&height=.5&distance=20&scheme=dark&axis=virtual
// &rollback=3&body=7&marks=borders,contacts
function obey(asked) {
  const number = name => asked.has(name) ? Number(asked.get(name)) : null;
  for (const name of ['azimuth', 'height']) eye[name] = number(name) ?? eye[name];
  lookAtAll(canvas.clientWidth, canvas.clientHeight);
  eye.distance = number('distance') ?? eye.distance;
  if (asked.has('colour')) byId('colour').value = asked.get('colour');
  if (asked.has('marks'))
    for (const box of document.querySelectorAll('#marks input'))
      box.checked = asked.get('marks').split(',').includes(box.value);
  setScheme(asked.get('scheme') || 'auto');
  setAxis(asked.get('axis') !== 'virtual');
  toStep(number('step') ?? stepOf(0));
  const body = placeOfLabel.get(number('body'));
  if (body !== undefined) chooseBody(body, false);
  const rollback = timeline ? timeline.rollbacks.findIndex(r => r.number === number('rollback'))
                            : -1;
  if (rollback >= 0) chooseRollback(rollback);
}

function begin() {
  byId('name').textContent = run.name;
  byId('counts').textContent = `${BODIES} bodies, ${run.worlds} worlds` +
    (timeline ? `, ${timeline.allExecutions} events, ${timeline.allRollbacks} rollbacks` : '');
  byId('frame').max = LAST;
  byId('sampled').replaceChildren(...sampledWords().map(words => element('p', words)));
  byId('timeline').hidden = timeline === null;
  byId('rollback-keys').hidden = timeline === null;
  byId('meaning').open = !matchMedia('(max-width: 760px)').matches;
  if (marks.joints.length === 0) byId('marks').querySelector('[value=joints]').disabled = true;
  if (timeline) {
    followPointer(lanes, clickTimeline);
    lanes.addEventListener('pointermove', hoverTimeline);
  }
  plots.forEach(makePlot);
  followers.push(showAll);
  listen();
  obey(new URLSearchParams(location.hash.slice(1)));
}
begin();
