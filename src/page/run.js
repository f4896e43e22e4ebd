'use strict';
// run.js: the run as its files tell it. The program has checked that lines are what they should be; numbers may be missing.

function readLines(id) {
  return JSON.parse(document.getElementById(id).textContent);
}

// A number, or null for what is none.
const numberOr = x => (Number.isFinite(x) ? x : null);

// Frame numbers are digits; a single file may have none.
function frameNumber(label) {
  return /^[0-9]{1,15}$/.test(label) ? Number(label) : null;
}

// Where each frame stands in the animated glTF, seconds: it begins at the first frame shown, and skipped frames take their time.
function placeInTime(frames, fps) {
  let at = 0;
  frames.forEach((f, i) => {
    const last = frames[i - 1];
    if (last) at += f.number !== null && last.number !== null ? Math.max(1, f.number - last.number) : 1;
    f.time = at;
  });
  const start = frames.find(f => f.fate !== 'skipped')?.time ?? 0;
  for (const f of frames) f.time = (f.time - start) / fps;
}

function readFrames(report, fps) {
  const frames = report.filter(line => 'frame' in line).map(line => ({
    label: line.frame, number: frameNumber(line.frame), fate: line.fate, surface: line.surface,
    count: line.events ?? {}, events: [], seconds: null,
    figure: name => numberOr(line[name]),
  }));
  placeInTime(frames, fps);
  return frames;
}

function readRun() {
  const report = readLines('report'), totals = report.at(-1).totals ?? null, settings = report[0].settings;
  const fps = settings.fps > 0 ? settings.fps : 24;
  const frames = readFrames(report, fps), byLabel = new Map(frames.map(f => [f.label, f]));
  const events = readLines('events'), timings = readLines('timings');
  for (const e of events) if (e.kind && e.kind !== 'components') byLabel.get(e.frame)?.events.push(e);
  for (const t of timings) if (byLabel.has(t.frame)) byLabel.get(t.frame).seconds = t;
  return {
    version: report[0].version, settings, fps, frames, totals,
    tracked: frames.filter(f => f.fate === 'tracked'),
    hasEvents: events.length > 0, hasTimings: timings.length > 0,
  };
}

// All numbers of one name, over tracked frames.
function figures(run, name) {
  return run.tracked.map(f => f.figure(name)).filter(x => x !== null);
}

const sum = list => list.reduce((a, b) => a + b, 0);
const mean = list => (list.length ? sum(list) / list.length : null);
const greatest = list => list.reduce((a, b) => (a === null || b > a ? b : a), null);
const least = list => list.reduce((a, b) => (a === null || b < a ? b : a), null);

// Three digits, thousands with a thin space; a dash for what is not known.
function say(x, unit = '') {
  if (x === null || x === undefined) return '–';
  const a = Math.abs(x);
  const text = a === 0 ? '0' : a >= 1000 || Number.isInteger(x) ? Math.round(x).toString().replace(/\B(?=(\d{3})+$)/g, '\u202f')
    : a >= 0.001 ? Number(x.toPrecision(3)).toString() : x.toExponential(1);
  return unit === '°' ? text + unit : unit ? `${text}\u202f${unit}` : text;
}

// --- elements --------------------------------------------------------------------------------------

function element(name, attributes = {}, ...children) {
  const e = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) e.setAttribute(key, value);
  e.append(...children);
  return e;
}

function svgElement(name, attributes = {}, text = null) {
  const e = document.createElementNS('http://www.w3.org/2000/svg', name);
  for (const [key, value] of Object.entries(attributes)) e.setAttribute(key, value);
  if (text !== null) e.textContent = text;
  return e;
}
