'use strict';
const byId = id => document.getElementById(id);

// What soda has written into the page, taken in the same order: little-endian, counts first.
class Bytes {
  constructor(id) {
    const letters = atob(byId(id).textContent), bytes = new Uint8Array(letters.length);
    for (let i = 0; i < letters.length; ++i) bytes[i] = letters.charCodeAt(i);
    byId(id).textContent = '';  // it takes memory
    this.view = new DataView(bytes.buffer);
    this.at = 0;
  }
  take(get, size) { this.at += size; return this.view[get](this.at - size, true); }
  byte() { return this.take('getUint8', 1); }
  short() { return this.take('getUint16', 2); }
  word() { return this.take('getUint32', 4); }
  whole() { return Number(this.take('getBigInt64', 8)); }
  float() { return this.take('getFloat32', 4); }
  double() { return this.take('getFloat64', 8); }
  count() { return Number(this.take('getBigUint64', 8)); }
  list(item) { return Array.from({length: this.count()}, item); }
  // A list as an array of numbers; 64-bit ones as doubles, which are exact up to 2^53.
  column(type) {
    const n = this.count(), size = type.BYTES_PER_ELEMENT, from = this.at;
    this.at += n * size;
    return new type(this.view.buffer.slice(from, this.at));
  }
  wholes() { return Float64Array.from(this.column(BigInt64Array), Number); }
  text() { return new TextDecoder().decode(this.column(Uint8Array)); }
  three(get) { return [get(), get(), get()]; }
}

const AWAY = 0xffff, RESTING = 0x8000, POSE_BYTES = 15, NOBODY = 0xffffffff;
const FIRST_STATIC = 0x80000000, WORLD_BODY = 0xffffffff;

function takeRecording(bytes) {
  const double = () => bytes.double(), word = () => bytes.word(), floats = () =>
    bytes.column(Float32Array);
  const run = {
    name: bytes.text(), dt_s: double(), up: bytes.three(double), worlds: word(),
    bodies: bytes.list(() => ({label: word(), shape: word()})),
    statics: bytes.list(() => ({name: bytes.text(), shape: word(), pose: floats()})),
    steps: bytes.list(() => bytes.whole()),
    shapes: bytes.list(floats),
    grid: {origin: bytes.three(double), size: double(), cells: bytes.three(word)},
    cellOwners: bytes.column(Uint16Array),
    changes: bytes.list(() => ({frame: word(), cell: word(), from: bytes.short(),
                                to: bytes.short()})),
    owners: bytes.column(Uint16Array),
    low: bytes.three(double), size: bytes.three(double),
  };
  run.poses = new DataView(bytes.view.buffer, bytes.at);
  return run;
}

function takeMarks(bytes) {
  const float = () => bytes.float(), word = () => bytes.word();
  return {
    every: word(), strongestOnly: bytes.byte() === 1,
    joints: bytes.list(() => ({a: word(), b: word(), kind: bytes.byte(),
                               anchorA: bytes.three(float), anchorB: bytes.three(float),
                               label: word(), brokenFrom: word()})),
    energies: bytes.list(() => ({kinetic: float(), potential: float()})),
    frames: bytes.list(() => ({
      frame: word(),
      contacts: bytes.list(() => ({a: word(), b: word(), point: bytes.three(float),
                                   force: bytes.three(float), normal: float(), depth: float()})),
      ghosts: bytes.list(() => ({body: word(), world: bytes.short()})),
    })),
  };
}

function takeRollback(bytes) {
  return {
    number: bytes.word(), world: bytes.word(), at: bytes.whole(), restart: bytes.whole(),
    step: bytes.whole(), changedAt: bytes.double(), undone: bytes.word(), putBack: bytes.word(),
    wasted: bytes.whole(), becauseOf: bytes.word(), cause: bytes.word(),
    bodies: Array.from(bytes.column(Uint32Array)),
    arrows: bytes.list(() => ({from: bytes.word(), sent: bytes.whole(), arrived: bytes.whole(),
                               sentAt: bytes.double(), anti: bytes.byte() === 1})),
    text: bytes.text(),
  };
}

// Null if the log had no trace.
function takeTimeline(bytes) {
  if (bytes.byte() === 0) return null;
  const head = {
    worlds: bytes.word(), buffer: bytes.whole(), modelled: bytes.byte() === 1,
    allExecutions: bytes.count(), allRollbacks: bytes.count(), stepsABar: bytes.whole(),
    end: bytes.whole(), unit: bytes.whole(),
  };
  const inNs = units => Float64Array.from(units, value => value * head.unit);
  const bars = {
    began: inNs(bytes.column(Uint32Array)), ended: inNs(bytes.column(Uint32Array)),
    world: bytes.column(Uint32Array), step: bytes.column(Uint32Array),
    lastStep: bytes.column(Uint32Array), rollback: bytes.column(Uint32Array),
    phase: bytes.column(Uint8Array), fate: bytes.column(Uint8Array),
    busy: bytes.column(Uint8Array),
  };
  return {
    ...head, bars,
    causes: bytes.list(() => bytes.text()),
    rollbacks: bytes.list(() => takeRollback(bytes)),
    samples: {executed: bytes.column(Uint32Array), undone: bytes.column(Uint32Array),
              committed: bytes.column(Uint32Array), reached: bytes.column(Uint32Array)},
    stepsACost: bytes.whole(),
    costs: {kept: bytes.wholes(), inVain: bytes.wholes()},
    commits: {steps: bytes.wholes(), at: bytes.wholes()},
  };
}

const run = takeRecording(new Bytes('recording'));
const marks = takeMarks(new Bytes('marks-data'));
const timeline = takeTimeline(new Bytes('timeline-data'));
const LAST = run.steps.length - 1;
