
// One cursor for all panels: a frame, its step, and a time on the executor's clock.
const cursor = {frame: 0, share: 0, wall: 0};
const chosen = {body: -1, rollback: -1};
const followers = [];  // called when anything of this changes
let drawAsked = false;
function changedAnything() {
  if (drawAsked) return;
  drawAsked = true;
  requestAnimationFrame(() => {
    drawAsked = false;
    for (const follow of followers) follow();
  });
}

const stepOf = frame => run.steps[frame];
const frameOfStep = step => within(0, placeAfter(run.steps, step) - 1, LAST);

// State k of a run is committed from a time on; between the times that the page knows, it is
// taken to go evenly.
function between(from, to, x) {
  const i = within(1, placeAfter(from, x), from.length - 1);
  if (from.length < 2) return to[0] || 0;
  const length = from[i] - from[i - 1];
  return to[i - 1] + (length > 0 ? within(0, (x - from[i - 1]) / length, 1) : 1) *
    (to[i] - to[i - 1]);
}
const wallOfStep = step => timeline ? between(timeline.commits.steps, timeline.commits.at, step)
                                    : 0;
const stepAtWall = wall => between(timeline.commits.at, timeline.commits.steps, wall);

function toFrame(frame) {
  cursor.frame = within(0, Math.round(frame), LAST);
  cursor.share = 0;
  cursor.wall = wallOfStep(stepOf(cursor.frame));
  changedAnything();
}
function toStep(step) { toFrame(frameOfStep(step)); }
function toWall(wall) {
  const until = within(0, wall, timeline.end);
  toFrame(frameOfStep(stepAtWall(until) + 1e-9));
  cursor.wall = until;
}

// Playing
const player = {on: false, at: 0, time: 0};
function play(on) {
  player.on = on;
  byId('play').textContent = on ? 'pause' : 'play';
  if (!on) {
    if (cursor.share > 0) toFrame(cursor.frame);
    return;
  }
  if (cursor.frame === LAST) toFrame(0);
  player.time = stepOf(cursor.frame) * run.dt_s;
  player.at = performance.now();
  requestAnimationFrame(advance);
}
function advance(now) {
  if (!player.on) return;
  player.time += Math.max(0, now - player.at) / 1000 * Number(byId('rate').value);
  player.at = now;
  const step = player.time / run.dt_s, frame = frameOfStep(step + 1e-9);
  toFrame(frame);
  if (frame === LAST) return play(false);
  // Between frames that lie several steps apart, bodies are drawn on the way.
  cursor.share = within(0, (step - stepOf(frame)) / (stepOf(frame + 1) - stepOf(frame)), 1);
  requestAnimationFrame(advance);
}

function chooseBody(body, looksThere) {
  chosen.body = body;
  if (looksThere && body >= 0 && isThere(cursor.frame, body)) {
    eye.target = Array.from(poseOf(cursor.frame, body).subarray(0, 3));
    eye.distance = Math.min(eye.distance, 14 * radiusOf(body));
  }
  changedAnything();
}
// The rollback with its bodies; the cursor goes to the state that its step began with.
function chooseRollback(index) {
  play(false);
  chosen.rollback = index;
  if (index >= 0) {
    const rollback = timeline.rollbacks[index];
    toStep(rollback.step);
    cursor.wall = rollback.at;
  }
  changedAnything();
}
const bodiesOfRollback = () => chosen.rollback < 0 ? []
                                                   : timeline.rollbacks[chosen.rollback].bodies;
