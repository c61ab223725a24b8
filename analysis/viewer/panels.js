
// What is chosen, found and meant, in words
const element = (tag, text, more = {}) =>
  Object.assign(document.createElement(tag), {textContent: text}, more);
const button = (text, onclick) => element('button', text, {onclick, type: 'button'});

// Digits that the page can answer for: places are kept as parts of the recording's extent.
const placeDigits = within(0, Math.floor(-Math.log10(Math.max(...run.size, 1e-6) / 0xffffff)), 6);

function bodyLines(body) {
  if (!isThere(cursor.frame, body)) return ['is not there'];
  const pose = poseOf(cursor.frame, body), owner = ownerOf(cursor.frame, body);
  const marked = markedAt(cursor.frame), id = body;
  const worlds = marked.ghosts.filter(ghost => ghost.body === id).map(ghost => ghost.world);
  const touching = marked.contacts.filter(contact => contact.a === id || contact.b === id);
  const lines = [
    `in the territory of world ${owner}` +
      (worlds.length > 0 ? `, a ghost in world ${worlds.join(', ')}` : ''),
    `at ${Array.from(pose.subarray(0, 3), x => x.toFixed(placeDigits)).join(', ')} m`,
    isResting(cursor.frame, body) ? 'at rest' : `speed ${pose[7].toPrecision(2)} m/s`];
  const when = marked.frame === cursor.frame ? '' : `, of step ${run.steps[marked.frame]}`;
  if (touching.length > 0) lines.push(`contacts${when}:`);
  for (const contact of touching.slice(0, 8))
    lines.push(`  ${nameOf(contact.a === id ? contact.b : contact.a)}: ` +
               `${shortNumber(Math.hypot(...contact.force))} N`);
  if (touching.length > 8) lines.push(`  and ${touching.length - 8} more`);
  for (const joint of jointsAt(cursor.frame).filter(j => j.a === id || j.b === id).slice(0, 8))
    lines.push(`joint ${joint.label} with ` +
               (joint.b === WORLD_BODY ? 'the world' : nameOf(joint.a === id ? joint.b : joint.a)));
  return lines;
}

// Of which step contacts and ghosts are, if not of the one that is shown.
function showMarked() {
  const {frame} = markedAt(cursor.frame);
  byId('marked').textContent =
    frame === cursor.frame ? '' : `contacts, ghosts: of step ${run.steps[frame]}`;
}

function showBody() {
  const box = byId('body');
  box.hidden = chosen.body < 0;
  if (box.hidden) return;
  box.querySelector('h2').textContent = nameOf(chosen.body);
  box.querySelector('pre').textContent = bodyLines(chosen.body).join('\n');
}

let rollbackTold = null;
function showRollback() {
  const box = byId('rollback');
  box.hidden = chosen.rollback < 0;
  if (rollbackTold === chosen.rollback) return;
  rollbackTold = chosen.rollback;
  if (box.hidden) return;
  const rollback = timeline.rollbacks[chosen.rollback], room = byId('lanes-room');
  if (room.scrollHeight > room.clientHeight)  // of many worlds some lanes are out of sight
    room.scrollTop = laneMiddle(rollback.world) - room.clientHeight / 2;
  const [first, ...rest] = rollback.text.trimEnd().split('\n');
  byId('rollback-name').textContent =
    `rollback ${rollback.number} of ${timeline.allRollbacks}: ${timeline.causes[rollback.cause]}`;
  byId('why').replaceChildren(...(rollback.text === ''
    ? [element('p', `World ${rollback.world} went back to step ${rollback.restart}. ` +
                    `soda why LOG --rollback ${rollback.number} tells the rest.`)]
    : [element('p', first), ...rest.map(line => element('p', line.trim()))]));
  byId('rollback-bodies').replaceChildren(
    ...(rollback.bodies.length > 0 ? ['Bodies: '] : []),
    ...rollback.bodies.map(body => button(String(run.bodies[body].label),
                                          () => chooseBody(body, true))));
  byId('because').replaceChildren(...(rollback.becauseOf === NOBODY ? [] : [
    'because of ', button(`rollback ${timeline.rollbacks[rollback.becauseOf].number}`,
                          () => chooseRollback(rollback.becauseOf))]));
}
function stepRollback(by) {
  if (!timeline || timeline.rollbacks.length === 0) return;
  const many = timeline.rollbacks.length;
  let next = chosen.rollback + by;
  if (chosen.rollback < 0) {
    next = timeline.rollbacks.findIndex(rollback => rollback.at >= cursor.wall);
    if (by < 0) next = next < 0 ? many - 1 : next - 1;
  }
  chooseRollback(within(0, next, many - 1));
}

function showClock() {
  const {frame} = cursor, step = stepOf(frame);
  byId('frame').value = frame;
  byId('clock').textContent = `step ${step} of ${stepOf(LAST)}, ${(step * run.dt_s).toFixed(3)} s` +
    (timeline ? `, clock ${timeWords(cursor.wall)}` : '') +
    (run.changes.length > 0 ? `, ${changed} cells changed hands` : '');
  byId('scene').dataset.frame = frame;
}

// Legend
function swatch(colour, words, kind = 'area') {
  const item = element('li', words), mark = element('i', '');
  mark.className = kind;
  mark.style.setProperty('--of', colour);
  item.prepend(mark);
  return item;
}
function bodyLegend() {
  const by = byId('colour').value;
  if (by === 'speed') return [swatch(css(speedColour(0)), 'slow'),
    swatch(css(speedColour(fastest)), `${shortNumber(fastest)} m/s, the fastest`)];
  if (by === 'rest') return [swatch(css(REST.resting), 'at rest: no velocity, costs no solve'),
                             swatch(css(REST.moving), 'moving')];
  if (by === 'island') return [swatch(css(islandColour(1)), 'bodies that touch or are joined'),
                               swatch(css(REST.kept), 'alone')];
  const most = 8;
  return framesOf(Math.min(most, run.worlds)).map(w => swatch(worldSwatch(w), `world ${w}`))
    .concat(run.worlds > most ? [element('li', `and ${run.worlds - most} more`)] : []);
}
function showLegend() {
  const list = bodyLegend().concat([
    swatch(worldSwatch(1), 'rim: a ghost in the world of that colour', 'shell'),
    swatch(theme.contact, 'contact, with its force on the second', 'stroke'),
    swatch(theme.joint, 'joint', 'stroke'),
    swatch(theme.mixed, 'mixed island: bodies of several worlds', 'stroke'),
    swatch(theme.border, 'border between territories', 'stroke')]);
  if (timeline) list.push(
    swatch(theme.committed, 'executed and committed'),
    swatch(theme.again, 'committed, again after a rollback'),
    swatch(theme.undone, 'rolled back'),
    swatch(theme.undone, 'rollback: click it', 'notch'),
    swatch(theme.repeated, 'repeated as it stood'),
    swatch(theme.open, 'not committed when the run ended'),
    swatch(theme.lane, 'waiting, or nothing to do'),
    swatch(theme.ink, 'line in a lane: how full the buffer is', 'stroke'),
    swatch(theme.gvt, 'GVT passes a step', 'stroke'));
  byId('legend').replaceChildren(...list);
}

// What the page leaves out
function sampledWords() {
  const words = [];
  const apart = LAST > 0 ? stepOf(1) - stepOf(0) : 1;
  if (apart > 1) words.push(`One step in ${apart} is a frame; playing draws bodies on the way.`);
  if (marks.every > 1)
    words.push(`Contacts, ghosts, islands and penetration are of one frame in ${marks.every}: ` +
               'in between, those of the nearest are drawn with their bodies.');
  if (marks.strongestOnly) words.push('Of some frames only the contacts that bear most are kept.');
  if (marks.frames.some(frame => frame.contacts.length > MOST_ARROWS))
    words.push(`Of many contacts some ${MOST_ARROWS} are drawn.`);
  if (!timeline) {
    words.push('The log has no trace: soda run --log-level trace adds the timeline of all worlds.');
    return words;
  }
  const bars = timeline.bars.world.length;
  const {stepsABar} = timeline, most = stepsABar > 1 ? `${stepsABar} steps` : 'one step';
  if (stepsABar > 0)
    words.push(`${timeline.allExecutions} events are drawn as ${bars} bars, of ${most} each at ` +
               'most; paler where a world did not work all the time.');
  if (timeline.rollbacks.length < timeline.allRollbacks)
    words.push(`Of ${timeline.allRollbacks} rollbacks the ${timeline.rollbacks.length} are here ` +
               'that cost most.');
  if (timeline.modelled) words.push('The clock is that of the virtual cluster.');
  return words;
}

// Search: labels that begin with what was typed, the exact one first.
function search() {
  const typed = byId('search').value.trim(), found = [];
  const exact = placeOfLabel.get(Number(typed));
  if (typed !== '' && exact !== undefined) found.push(exact);
  for (let body = 0; typed !== '' && body < BODIES && found.length < 8; ++body)
    if (body !== exact && String(run.bodies[body].label).startsWith(typed)) found.push(body);
  byId('found').replaceChildren(...(typed !== '' && found.length === 0
    ? [element('span', `no body ${typed}`)]
    : found.map(body => button(nameOf(body), () => chooseBody(body, true)))));
  return found;
}
