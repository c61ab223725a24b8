// Appended to a page of `soda view`: the least of 20 times that each panel takes.
const leastOf = act => Math.min(...framesOf(20).map(i => {
  Object.assign(cursor, {frame: (2 * i) % Math.max(1, LAST), share: 0.5});
  const begun = performance.now();
  act();
  return performance.now() - begun;
}));
const pixel = new Uint8Array(4);
const times = {
  'load': performance.now(),
  'scene, script': leastOf(() => drawScene(cursor.frame, cursor.share, new Set())),
  'scene with WebGL': leastOf(() => {
    drawScene(cursor.frame, cursor.share, new Set());
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
  }),
  'other panels, cursor moved': leastOf(() => {
    showTimeline(); showPlots(); showClock(); showBody(); showRollback();
  }),
  'timeline and plots anew': leastOf(() => { pictures.clear(); showTimeline(); showPlots(); }),
  'click': leastOf(() => timeline && rollbackAt(500, 60, 9)),
};
document.body.append(element('pre', Object.entries(times)
  .map(([name, ms]) => `${ms.toFixed(1).padStart(9)} ms  ${name}`).join('\n'), {id: 'times'}));
