'use strict';
// timeline.js: events by kind and frame, and the list of those chosen.

const eventKinds = [
  { kind: 'blend', name: 'blends', color: 'c0' }, { kind: 'split', name: 'splits', color: 'c1' },
  { kind: 'birth', name: 'births', color: 'c2' }, { kind: 'death', name: 'deaths', color: 'c3' },
  { kind: 'hole-open', name: 'holes opened', color: 'c4' }, { kind: 'hole-close', name: 'holes closed', color: 'c5' },
  { kind: 'mend', name: 'patches mended', color: 'c8' },
];
const countOf = (f, kind) => Math.max(0, numberOr(f.count[kind]) ?? 0);
const eventsOf = (f, kind) => f.events.filter(e => e.kind === kind);
const placesOf = events => events.flatMap(e => e.places);

// A list of what happened; choosing a row marks its places alone.
function listEvents(host, frame, kind, mark) {
  const events = eventsOf(frame, kind.kind), shown = events.slice(0, 500);
  const names = list => (list.length > 8 ? `${list.slice(0, 8).join(', ')} and ${list.length - 8} more` : list.join(', ') || '–');
  const rows = shown.map(e => {
    const row = element('tr', {}, ...[names(e.before), names(e.after), say(e.count), say(e.replaced), e.place.map(x => say(x)).join(', ')]
      .map(text => element('td', {}, text)));
    row.addEventListener('click', () => {
      host.querySelector('[aria-current]')?.removeAttribute('aria-current');
      row.setAttribute('aria-current', 'true');
      mark(e.places);
    });
    return row;
  });
  const more = events.length > shown.length ? `, the first ${shown.length} listed` : '';
  host.replaceChildren(element('table', {},
    element('caption', {}, `Frame ${frame.label}, ${kind.name}: ${countOf(frame, kind.kind)}${more}`),
    element('thead', {}, element('tr', {}, ...['components before', 'after', 'count', 'vertices replaced', 'place'].map(t => element('th', {}, t)))),
    element('tbody', {}, ...rows)));
}

// `choose(frame, kind)` is called when a dot is pressed.
function makeTimeline(host, run, cursor, choose) {
  const svg = host.appendChild(svgElement('svg', { role: 'img', 'aria-label': 'Events by kind and frame' }));
  const rowHeight = 25, top = 4, bottom = top + rowHeight * eventKinds.length;
  const most = greatest([1, ...run.frames.flatMap(f => eventKinds.map(k => countOf(f, k.kind)))]);
  const totals = eventKinds.map(k => sum(run.frames.map(f => countOf(f, k.kind))));
  let columns = null, moveLines = () => {}, labels = [];
  const tell = () => labels.forEach((t, k) => {
    t.textContent = cursor.look === null ? say(totals[k]) : say(countOf(run.frames[cursor.look], eventKinds[k].kind));
  });
  // Areas go with the counts.
  const radius = n => Math.max(1.6, (rowHeight / 2 - 1) * Math.sqrt(n / most));
  let chosen = null;
  const showChosen = () => {
    for (const dot of svg.querySelectorAll('.event'))
      dot.classList.toggle('chosen', dot.dataset.frame === chosen?.frame && dot.dataset.kind === chosen?.kind);
  };
  const drawRow = (k, y, width) => {
    svg.append(svgElement('line', { class: 'gridline', x1: columns.left, x2: columns.right, y1: Math.round(y) + 0.5, y2: Math.round(y) + 0.5 }));
    svg.append(svgElement('text', { x: 0, y: y + 4 }, eventKinds[k].name));
    labels.push(svg.appendChild(svgElement('text', { x: width - 4, y: y + 4, 'text-anchor': 'end' })));
    run.frames.forEach((f, i) => {
      const n = countOf(f, eventKinds[k].kind);
      if (!n) return;
      const dot = svgElement('circle', { class: 'event', style: `--color: var(--${eventKinds[k].color})`, cx: columns.middle(i), cy: y, r: radius(n),
        'data-frame': f.label, 'data-kind': eventKinds[k].kind });
      dot.append(svgElement('title', {}, `frame ${f.label}, ${eventKinds[k].name}: ${n}`));
      svg.append(dot);
    });
  };
  const draw = () => {
    const width = host.clientWidth;
    if (width < 50) return;
    columns = new Columns(run.frames.length, 104, width - 48);
    svg.replaceChildren();
    svg.setAttribute('viewBox', `0 0 ${width} ${bottom + 20}`);
    svg.setAttribute('height', bottom + 20);
    shadeFrames(svg, columns, run.frames, top, bottom);
    labelFrames(svg, columns, run.frames, bottom + 15);
    moveLines = cursorLines(svg, cursor, columns, top, bottom);
    labels = [];
    eventKinds.forEach((_, k) => drawRow(k, top + (k + 0.5) * rowHeight, width));
    moveLines();
    showChosen();
    tell();
  };
  // The whole square of a dot is pressed, not the dot: some are small.
  svg.addEventListener('click', event => {
    const box = svg.getBoundingClientRect(), i = columns.at(event.clientX - box.left);
    const kind = eventKinds[Math.floor((event.clientY - box.top - top) / rowHeight)];
    if (!kind || !countOf(run.frames[i], kind.kind)) return;
    chosen = { frame: run.frames[i].label, kind: kind.kind };
    showChosen();
    choose(i, kind);
  });
  followPointer(svg, cursor, () => columns);
  cursor.addEventListener('change', () => { moveLines(); tell(); });
  new ResizeObserver(draw).observe(host);
}
