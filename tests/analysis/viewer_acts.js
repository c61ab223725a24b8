// What a user does with a page of `soda view`, through its events; what is not as it should be is
// listed in #verdict, with each error that the page has told of (`faults`, begun before the page).
Element.prototype.setPointerCapture = () => {};  // of pointers that there are; ours are made up

const settled = () => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)));
const expect = (holds, what) => { if (!holds) faults.push(what); };

async function pointer(panel, kind, x, y, more = {}) {
  const box = panel.getBoundingClientRect();
  panel.dispatchEvent(new PointerEvent(kind, {
    bubbles: true, cancelable: true, pointerId: 7, button: 0, pointerType: 'mouse',
    clientX: box.left + x, clientY: box.top + y, ...more}));
}
async function click(panel, x, y, more) {
  pointer(panel, 'pointerdown', x, y, more);
  pointer(panel, 'pointerup', x, y, more);
  await settled();
}
async function key(target, name) {
  target.dispatchEvent(new KeyboardEvent('keydown', {key: name, bubbles: true, cancelable: true}));
  await settled();
}
const panels = () => [lanes, ...plots.map(plot => plot.canvas)];

// How many pixels of a column have this colour.
function coloured(panel, x, colour) {
  const scale = panel.width / panel.clientWidth, wanted = theme.rgb[colour].map(c => 255 * c);
  const pixels = panel.getContext('2d')
    .getImageData(Math.max(0, Math.round(x * scale) - 2), 0, 5, panel.height).data;
  let count = 0;
  for (let i = 0; i < pixels.length; i += 4)
    if (wanted.every((value, k) => Math.abs(pixels[i + k] - value) < 40)) ++count;
  return count;
}
// All panels show the cursor where it is on the axis, in their pictures, too.
function expectCursor(act, value) {
  for (const panel of panels()) {
    const name = `${act}: ${panel.getAttribute('aria-label')}`, x = toX(value, panel);
    expect(Math.abs(Number(panel.dataset.cursor) - x) < 1.5, `${name} does not follow`);
    expect(coloured(panel, x, 'cursor') > panel.height / 3, `${name} shows no cursor`);
  }
  expect(Number(byId('frame').value) === cursor.frame, `${act}: the slider does not follow`);
  expect(byId('scene').dataset.frame === String(cursor.frame), `${act}: no other bodies`);
  expect(byId('clock').textContent.startsWith(`step ${run.steps[cursor.frame]} `),
         `${act}: the clock tells another step`);
}

async function moveTheCursor() {
  for (const [i, panel] of panels().entries()) {
    const before = byId('clock').textContent, x = widthOf(panel) * (0.85 - 0.07 * i);
    const value = toValue(x, panel);
    await click(panel, x, panel.clientHeight - 2);
    expect(byId('clock').textContent !== before, `a click on panel ${i} leaves the clock`);
    expectCursor(`click on panel ${i}`, value);
  }
  byId('frame').value = 30;
  byId('frame').dispatchEvent(new Event('input'));
  await settled();
  expect(cursor.frame === 30, 'the slider does not move the cursor');
  expectCursor('slider', wallOfStep(run.steps[30]));
  const from = GUTTER + 40, to = GUTTER + 0.6 * widthOf(lanes), touch = {pointerType: 'touch'};
  pointer(lanes, 'pointerdown', from, 120, touch);
  pointer(lanes, 'pointermove', to, 120, touch);
  pointer(lanes, 'pointerup', to, 120, touch);
  await settled();
  expectCursor('a finger', toValue(to, lanes));
}

function drawnScene() {
  drawScene(cursor.frame, 0, new Set());
  const pixels = new Uint8Array(4 * canvas.width * canvas.height), colours = new Set();
  gl.readPixels(0, 0, canvas.width, canvas.height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
  for (let i = 0; i < pixels.length; i += 4)
    colours.add(pixels[i] << 16 | pixels[i + 1] << 8 | pixels[i + 2]);
  return colours;
}
async function lookAtTheScene() {
  expect(gl !== null, 'no WebGL');
  if (gl === null) return;
  let most = 0;
  for (const colour of ['world', 'island', 'speed', 'rest']) {
    byId('colour').value = colour;
    byId('colour').dispatchEvent(new Event('change', {bubbles: true}));
    await settled();
    most = Math.max(most, drawnScene().size);
  }
  expect(most > 20, `the scene has ${most} colours`);
  expect(gl.getError() === 0, 'WebGL tells of an error');
  const drawn = linesOf(cursor.frame, posesOf(cursor.frame),
                        {shown: shownMarks(), emphasised: [], axes: eyeAxes(), pixel: 0.01});
  expect(drawn.borders.length > 0, 'no borders');
  expect(drawn.near.length > 0, 'no contacts');
}

async function clickARollback() {
  const index = timeline.rollbacks.findIndex(
    r => r.arrows.length > 0 && r.arrows[0].from !== NOBODY && r.bodies.length > 0 &&
         r.becauseOf !== NOBODY);
  expect(index >= 0, 'no rollback to click');
  const rollback = timeline.rollbacks[index], late = rollback.arrows[0];
  const length = Math.max(1000, late.arrived - late.sent);
  Object.assign(axis, {from: late.sent - length, to: late.arrived + length});
  pictures.clear();
  await click(lanes, rollbackX(rollback, lanes), laneTop(rollback.world) + 3);
  const told = timeline.rollbacks[chosen.rollback];
  expect(told === rollback && !byId('rollback').hidden,
         'a click on a rollback does not choose it');
  if (told !== rollback) return;
  const scale = lanes.width / lanes.clientWidth;
  const [x, y] = [toX(late.sent, lanes), laneMiddle(late.from)].map(at => Math.round(at * scale));
  const [r, g, b] = lanes.getContext('2d').getImageData(x, y, 1, 1).data;
  expect([r, g, b].every((value, k) => Math.abs(value - 255 * theme.rgb.ink[k]) < 40),
         'no arrow from where its message was sent');
  expect(byId('rollback-bodies').querySelectorAll('button').length === told.bodies.length &&
         told.bodies.length > 0, 'its bodies are not named');
  expect(Math.abs(cursor.wall - told.at) < 1, 'the cursor does not go there');
  expectCursor('rollback', told.at);
  byId('rollback-told').textContent = `${told.number}\n` +
    Array.from(byId('why').children, line => line.textContent).join('\n');
  byId('because').querySelector('button')?.click();
  await settled();
  setAxis(true);
}

async function useTheKeys() {
  byId('search').focus();
  const before = cursor.frame;
  await key(byId('search'), 'ArrowRight');
  await key(byId('search'), ' ');
  expect(cursor.frame === before && !player.on, 'keys act while the search has the focus');
  byId('search').value = String(run.bodies[BODIES - 1].label);
  await key(byId('search'), 'Enter');
  expect(!byId('body').hidden &&
         byId('body').textContent.includes(`body ${run.bodies[BODIES - 1].label}`),
         'the search does not find');
  await key(byId('search'), 'Escape');
  expect(document.activeElement !== byId('search'), 'Escape does not leave the search');
  toFrame(10);
  await key(document.body, 'ArrowRight');
  expect(cursor.frame === 11, 'an arrow does not go to the next frame');
  await key(document.body, 'Escape');
  expect(byId('body').hidden && byId('rollback').hidden, 'Escape does not let go');
  await key(document.body, 'n');
  expect(!byId('rollback').hidden, 'n goes to no rollback');
}

async function changeAxisAndScheme() {
  byId('axis').value = 'virtual';
  byId('axis').dispatchEvent(new Event('change'));
  toFrame(40);
  await settled();
  expectCursor('virtual time', run.steps[40]);
  const [from, to] = [axis.from, axis.to];
  pointer(lanes, 'pointerdown', 200, 60, {pointerId: 1});
  pointer(lanes, 'pointerdown', 260, 60, {pointerId: 2});
  pointer(lanes, 'pointermove', 380, 60, {pointerId: 2});
  pointer(lanes, 'pointerup', 380, 60, {pointerId: 2});
  pointer(lanes, 'pointerup', 200, 60, {pointerId: 1});
  await settled();
  expect(axis.to - axis.from < 0.6 * (to - from), 'two fingers do not zoom');
  for (const scheme of ['light', 'dark']) {
    setScheme(scheme);
    await settled();
    expect(getComputedStyle(document.body).backgroundColor ===
           (scheme === 'dark' ? 'rgb(20, 24, 31)' : 'rgb(243, 245, 248)'), `no ${scheme} scheme`);
  }
  expect(document.documentElement.scrollWidth <= window.innerWidth, 'wider than the window');
}

// Of a longer run contacts are of some frames only: in between, those of the nearest, where the body
// has gone meanwhile.
async function lookBetweenMarkedFrames() {
  marks.every = 4;
  marks.frames = marks.frames.filter(({frame}) => frame % marks.every === 0);
  for (const [frame, nearest] of [[44, 44], [41, 40], [43, 44]]) {
    toFrame(frame);
    await settled();
    const told = byId('marked').textContent;
    expect(nearest === frame ? told === '' : told.endsWith(`of step ${run.steps[nearest]}`),
           `contacts of frame ${nearest} at ${frame} are told as "${told}"`);
    const contacts = marks.frames[nearest / 4].contacts, {a, point} = contacts[0];
    const moved = add(point, add(poseOf(frame, a), poseOf(nearest, a), -1));
    const {near} = linesOf(frame, posesOf(frame), {shown: new Set(['contacts']), emphasised: [],
                                                   axes: eyeAxes(), pixel: 0.01});
    expect(near.length >= LINE * contacts.length, `no contacts at frame ${frame}`);
    expect(moved.every((x, k) => Math.abs(x - near[k]) < 1e-4),
           `a contact does not go along from frame ${nearest} to ${frame}`);
  }
}

async function act() {
  for (const id of ['rollback-told', 'verdict'])
    document.body.append(Object.assign(document.createElement('pre'), {id, hidden: true}));
  try {
    await settled();
    for (const acts of [moveTheCursor, lookAtTheScene, clickARollback, useTheKeys,
                        changeAxisAndScheme, lookBetweenMarkedFrames]) await acts();
  } catch (error) {
    faults.push(`${error} ${error.stack}`);
  }
  byId('verdict').textContent = faults.length === 0 ? 'all is well' : faults.join('\n');
}
act();
