
// What is measured over the run, on the axis of the timeline.
const framesOf = count => Array.from({length: count}, (_, i) => i);

function energyPlot() {
  const {energies} = marks, first = energies[0] || {kinetic: 0, potential: 0};
  const xs = run.steps.slice(0, energies.length);
  return {name: 'energy', unit: 'J', isStep: true, series: [
    {name: 'kinetic', colour: 'committed', xs, ys: energies.map(e => e.kinetic)},
    {name: 'all, since the start', colour: 'gvt', xs,
     ys: energies.map(e => e.kinetic + e.potential - first.kinetic - first.potential)}]};
}
function penetrationPlot() {
  return {name: 'penetration', unit: 'm', isStep: true, least: 0, series: [
    {name: 'deepest of contacts that bear', colour: 'contact',
     xs: marks.frames.map(frame => stepOf(frame.frame)),
     ys: marks.frames.map(frame => frame.contacts.reduce((most, c) => Math.max(most, c.depth), 0))},
  ]};
}
const sampleTimes = () => framesOf(timeline.samples.executed.length)
  .map(i => (i + 1) / timeline.samples.executed.length * timeline.end);

function leadPlot() {
  const {reached, committed} = timeline.samples, mean = [], most = [];
  for (let i = 0; i < committed.length; ++i) {
    let sum = 0, top = 0;
    for (let world = 0; world < WORLDS; ++world) {
      const lead = Math.max(0, reached[i * WORLDS + world] + 1 - committed[i]);
      sum += lead;
      top = Math.max(top, lead);
    }
    mean.push(sum / WORLDS);
    most.push(top);
  }
  const xs = sampleTimes();
  return {name: 'lead', unit: `of ${timeline.buffer} steps`, least: 0, series: [
    {name: 'foremost world', colour: 'again', xs, ys: most},
    {name: 'mean', colour: 'committed', xs, ys: mean}]};
}
function efficiencyPlot() {
  const {executed, undone} = timeline.samples, times = sampleTimes();
  const busy = framesOf(executed.length).filter(i => executed[i] > 0);
  return {name: 'efficiency', unit: '', least: 0, most: 1, series: [
    {name: 'events that stood, of those executed', colour: 'committed',
     xs: busy.map(i => times[i]), ys: busy.map(i => 1 - undone[i] / executed[i])}]};
}
function costPlot() {
  const {costs, stepsACost} = timeline, xs = framesOf(costs.kept.length)
    .map(i => stepOf(0) + i * stepsACost);
  return {name: 'cost', unit: stepsACost > 1 ? `ms in ${stepsACost} steps` : 'ms a step',
          isStep: true, isStair: true, least: 0, series: [
            {name: 'with work in vain', colour: 'undone', xs,
             ys: xs.map((_, i) => (costs.kept[i] + costs.inVain[i]) / 1e6)},
            {name: 'what stood', colour: 'committed', xs,
             ys: xs.map((_, i) => costs.kept[i] / 1e6)}]};
}

function rangeOf(plot) {
  let low = plot.least ?? Infinity, high = plot.most ?? -Infinity;
  for (const {ys} of plot.series)
    for (const y of ys) [low, high] = [Math.min(low, y), Math.max(high, y)];
  if (!(high > low)) [low, high] = [Math.min(low, 0) || 0, low > 0 ? low : 1];
  return [low, high];
}

const plots = (timeline ? [leadPlot(), efficiencyPlot(), costPlot()] : [])
  .concat([energyPlot(), penetrationPlot()]);
const PLOT_HEIGHT = 74;

function makePlot(plot) {
  const figure = document.createElement('figure'), head = document.createElement('figcaption');
  plot.range = rangeOf(plot);
  plot.canvas = document.createElement('canvas');
  plot.canvas.setAttribute('aria-label', plot.name);
  plot.told = document.createElement('span');
  head.append(Object.assign(document.createElement('b'), {textContent: plot.name}), ' ', plot.told);
  figure.append(head, plot.canvas);
  figure.title = plot.series.map(series => series.name).join('; ');
  byId('plots').append(figure);
  followPointer(plot.canvas);
}

const shortNumber = x => x === 0 ? '0' : Math.abs(x) >= 1e4 || Math.abs(x) < 1e-2
  ? x.toExponential(1).replace('e+', 'e') : String(Number(x.toPrecision(3)));

function drawPlot(plot, pen, element, height) {
  const [low, high] = plot.range, left = leftOf(element), top = 6, bottom = height - 6;
  const isStair = plot.isStair || (plot.isStep && axis.wall);
  const toY = y => bottom - (y - low) / (high - low) * (bottom - top);
  pen.fillStyle = theme.lane;
  pen.fillRect(left, 0, widthOf(element), height);
  pen.fillStyle = theme.faint;
  pen.textAlign = 'right';
  pen.fillText(shortNumber(high), left - 4, top + 3);
  pen.fillText(shortNumber(low), left - 4, bottom - 2);
  if (low < 0 && high > 0) pen.fillRect(left, toY(0), widthOf(element), 0.6);
  pen.save();
  pen.beginPath();
  pen.rect(left, 0, widthOf(element), height);
  pen.clip();
  pen.lineWidth = 1.4;
  pen.lineJoin = 'round';
  for (const {xs, ys, colour} of plot.series) {
    pen.strokeStyle = theme[colour];
    pen.beginPath();
    for (let i = 0; i < xs.length; ++i) {
      const x = toX(plot.isStep ? stepOnAxis(xs[i]) : wallOnAxis(xs[i]), element);
      if (i > 0 && isStair) pen.lineTo(x, toY(ys[i - 1]));  // it lasts until the next
      pen.lineTo(x, toY(ys[i]));
    }
    pen.stroke();
  }
  pen.restore();
}

function valueAtCursor(plot, {xs, ys}) {
  const at = plot.isStep ? stepOf(cursor.frame) : cursor.wall;
  return ys.length === 0 ? '-' : shortNumber(ys[within(0, placeAfter(xs, at) - 1, ys.length - 1)]);
}

function showPlots() {
  for (const plot of plots) {
    const pen = onPicture(plot.canvas, PLOT_HEIGHT,
                          (...on) => drawPlot(plot, ...on));
    drawCursor(pen, plot.canvas, 0, PLOT_HEIGHT);
    plot.canvas.dataset.cursor = toX(cursorOnAxis(), plot.canvas).toFixed(1);
    plot.told.replaceChildren(...plot.series.flatMap((series, i) => {
      const value = document.createElement('i');
      value.textContent = valueAtCursor(plot, series);
      value.style.color = theme[series.colour];
      return i === 0 ? [value] : [' / ', value];
    }), ` ${plot.unit}`);
  }
}
