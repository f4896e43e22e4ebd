'use strict';
// plots.js: the plots, as a table of what they show, and the drawing of one.

// A series: what it is called, its colour, and the number of a frame.
const series = (name, color, of) => ({ name, color, of: typeof of === 'string' ? f => f.figure(of) : of });
const share = name => f => (f.figure(name) === null ? null : 100 * f.figure(name));

const plotTable = [
  { name: 'triangles', title: 'Triangles', zero: true,
    series: [series('geometric', 'geometric', 'triangles_geometric'), series('mechanical', 'mechanical', 'triangles_mechanical')] },
  { name: 'components', title: 'Topology', zero: true,
    series: [series('components', 'c0', 'components'), series('of another topology than the grid', 'bad', 'wrong_components')] },
  { name: 'angles', title: 'Triangle quality', unit: '°', note: 'minimum angle, mechanical', zero: true, top: 60,
    series: [series('median', 'c2', 'min_angle_p50'), series('5th percentile', 'c1', 'min_angle_p5')] },
  { name: 'distance', title: 'Distance to the surface', unit: 'voxel', note: 'geometric edge midpoints, estimated', log: true,
    series: [series('largest', 'c3', 'distance_max_vox'), series('mean', 'c0', 'distance_mean_vox')] },
  { name: 'kept', title: 'Kept', unit: '%', zero: true, top: 100,
    series: [series('identities kept', 'c0', share('ids_kept')), series('edges within ½ to 2 of asked', 'c5', share('edges_in_range'))] },
  { name: 'left', title: 'Trouble left', zero: true,
    series: [series('self-intersections', 'bad', 'self_intersections'), series('inverted geometric', 'c0', 'inverted_left_geometric'),
      series('inverted mechanical', 'c1', 'inverted_left'), series('raw components', 'c4', 'raw_components')] },
  { name: 'edge', title: 'Mean edge / asked', zero: true,
    series: [series('mechanical', 'mechanical', f => (f.figure('edge_asked') ? f.figure('edge_mean') / f.figure('edge_asked') : null))] },
  { name: 'changes', title: 'Changes of the mechanical mesh', zero: true,
    series: [series('splits', 'c0', 'splits'), series('collapses', 'c1', 'collapses'), series('flips', 'c2', 'flips'),
      series('vertices replaced by patches', 'c3', 'replaced_vertices')] },
  { name: 'residual', title: 'Solver', note: 'residual of the last step', log: true, series: [series('residual', 'c4', 'cg_residual')] },
  { name: 'mended', title: 'Mend', zero: true,
    series: [series('faults found', 'c3', 'mend_faults'), series('patches sewn', 'c5', 'mend_patches')] },
];

// What follows one another within a frame; reading and writing go on beside it.
const stages = ['wait', 'predict', 'alter', 'relax', 'audit', 'mend', 'refine', 'carry'];
const secondsOf = (f, stage) => (Number.isFinite(f.seconds?.[stage]) ? Math.round(1000 * f.seconds[stage]) / 1000 : null);
function restOf(f) {
  const whole = secondsOf(f, 'whole');
  return whole === null ? null : Math.max(0, whole - sum(stages.map(s => secondsOf(f, s) ?? 0)));
}
const timesPlot = {
  name: 'times', title: 'Time by stage', unit: 's', note: 'stacked; reading and writing go on beside', stacked: true, wide: true, zero: true,
  series: [...stages.map((s, i) => series(s, `c${i}`, f => secondsOf(f, s))), series('rest', 'c8', restOf)],
};

// --- scales ----------------------------------------------------------------------------------------

// Round steps of 1, 2 or 5 that cut the range into about `wanted`.
function ticksBetween(low, high, wanted) {
  const raw = (high - low) / wanted, power = 10 ** Math.floor(Math.log10(raw));
  const step = power * [1, 2, 5, 10].find(m => m * power >= raw * 0.999);
  const ticks = [];
  for (let i = Math.ceil(low / step - 1e-9); i * step <= high + 1e-9 * step; i++) ticks.push(i * step);
  return ticks;
}

function linearScale(spec, values, bottom, top) {
  let low = spec.zero ? 0 : least(values) ?? 0, high = spec.top ?? Math.max(greatest(values) ?? 0, low);
  if (high <= low) high = low + 1;
  if (!spec.top) { // up to the next round number
    const ticks = ticksBetween(low, high, 4);
    high = ticks.length > 1 && ticks.at(-1) < high ? ticks.at(-1) + ticks[1] - ticks[0] : high;
  }
  const whole = high >= 4 || spec.unit || values.some(v => !Number.isInteger(v));
  const ticks = ticksBetween(low, high, 4).filter(t => whole || Number.isInteger(t));
  return { y: v => bottom - (bottom - top) * (v - low) / (high - low), ticks };
}

function logScale(values, bottom, top) {
  const positive = values.filter(v => v > 0);
  const low = Math.floor(Math.log10(least(positive) ?? 0.1)), high = Math.max(low + 1, Math.ceil(Math.log10(greatest(positive) ?? 1)));
  const ticks = [];
  for (let e = low; e <= high; e += Math.ceil((high - low) / 5)) ticks.push(10 ** e);
  const y = v => (v > 0 ? bottom - (bottom - top) * Math.max(0, (Math.log10(v) - low) / (high - low)) : bottom);
  return { y, ticks };
}

// --- one plot --------------------------------------------------------------------------------------

const valuesOf = (spec, run) => run.frames.map(f => spec.series.map(s => (f.fate === 'tracked' || spec.stacked ? numberOr(s.of(f)) : null)));

function drawAxes(svg, spec, scale, columns, frames, top, bottom) {
  for (const t of scale.ticks) {
    const y = Math.round(scale.y(t)) + 0.5;
    svg.append(svgElement('line', { class: 'gridline', x1: columns.left, x2: columns.right, y1: y, y2: y }));
    svg.append(svgElement('text', { x: columns.left - 6, y: y + 4, 'text-anchor': 'end' }, say(t)));
  }
  svg.append(svgElement('line', { class: 'base', x1: columns.left, x2: columns.right, y1: bottom + 0.5, y2: bottom + 0.5 }));
  shadeFrames(svg, columns, frames, top, bottom);
  labelFrames(svg, columns, frames, bottom + 15);
}

// A line with gaps where a number is missing; a number alone between gaps is a dot.
function drawLine(svg, color, numbers, scale, columns) {
  const style = `--color: var(--${color})`;
  let path = '', run = 0;
  numbers.forEach((v, i) => {
    if (v === null) { run = 0; return; }
    const x = columns.middle(i).toFixed(1), y = scale.y(v).toFixed(1);
    path += `${run++ ? 'L' : 'M'}${x} ${y}`;
    if (run === 1 && (numbers[i + 1] ?? null) === null) svg.append(svgElement('circle', { class: 'dot', style, cx: x, cy: y, r: 2.5 }));
  });
  svg.append(svgElement('path', { class: 'line', style, d: path }));
}

function drawStack(svg, spec, values, scale, columns) {
  const gap = columns.width > 6 ? 1 : 0;
  values.forEach((row, i) => {
    let below = 0;
    row.forEach((v, k) => {
      if (!v) return;
      const high = scale.y(below + v), low = scale.y(below);
      below += v;
      svg.append(svgElement('rect', { class: 'bar', style: `--color: var(--${spec.series[k].color})`,
        x: columns.middle(i) - columns.width / 2 + gap, width: Math.max(0.5, columns.width - 2 * gap), y: high, height: Math.max(0, low - high) }));
    });
  });
}

// The names of the series with the numbers of the frame that the cursor shows.
function makeLegend(spec, values, cursor) {
  const shown = spec.series.map(() => element('b'));
  const legend = element('div', { class: 'legend' }, ...spec.series.map((s, k) =>
    element('span', { style: `--color: var(--${s.color})` }, element('i'), `${s.name} `, shown[k])));
  const update = () => shown.forEach((b, k) => { b.textContent = say(values[cursor.shown][k], spec.unit === '%' || spec.unit === '°' ? spec.unit : ''); });
  return { legend, update };
}

function makePlot(host, spec, run, cursor) {
  const values = valuesOf(spec, run);
  const heights = spec.stacked ? values.map(sum) : values.flat().filter(v => v !== null);
  const { legend, update } = makeLegend(spec, values, cursor);
  const title = element('h2', {}, spec.title, spec.unit ? ` [${spec.unit}]` : '');
  if (spec.note) title.append(element('small', {}, `  ${spec.note}`));
  const svg = svgElement('svg', { role: 'img', 'aria-label': spec.title });
  const box = host.appendChild(element('div', { class: spec.wide ? 'plot wide' : 'plot', 'data-plot': spec.name }, title, legend, svg));
  const top = 8, bottom = spec.wide ? 168 : 138;
  let columns = null, moveLines = () => {};
  const draw = () => {
    const width = box.clientWidth - 24;
    if (width < 50) return;
    columns = new Columns(run.frames.length, 52, width - 6);
    svg.replaceChildren();
    svg.setAttribute('viewBox', `0 0 ${width} ${bottom + 22}`);
    svg.setAttribute('height', bottom + 22);
    const scale = spec.log ? logScale(heights, bottom, top) : linearScale(spec, heights, bottom, top);
    drawAxes(svg, spec, scale, columns, run.frames, top, bottom);
    if (spec.stacked) drawStack(svg, spec, values, scale, columns);
    else spec.series.forEach((s, k) => drawLine(svg, s.color, values.map(row => row[k]), scale, columns));
    moveLines = cursorLines(svg, cursor, columns, top, bottom);
    moveLines();
  };
  followPointer(svg, cursor, () => columns);
  cursor.addEventListener('change', () => { update(); moveLines(); });
  new ResizeObserver(draw).observe(box);
  update();
}
