'use strict';
// page.js: puts the run on the page, and ties player, plots and timeline together.

// --- head ------------------------------------------------------------------------------------------

function tellAbout(run) {
  const first = run.frames[0], last = run.frames.at(-1), surface = run.frames.find(f => f.surface)?.surface;
  const span = !run.frames.length ? 'no frames' : run.frames.length === 1 ? `frame ${first.label}` : `${run.frames.length} frames, ${first.label} to ${last.label}`;
  byId('about').textContent = [`twinmesh ${run.version}`, span, surface].filter(Boolean).join(' · ');
}

function tellVerdict(run) {
  const wrong = run.tracked.filter(f => f.figure('wrong_components') !== 0);
  const box = byId('verdict');
  box.className = wrong.length ? 'bad' : 'good';
  box.textContent = !run.tracked.length ? 'No frame was tracked.'
    : !wrong.length && run.tracked.length === 1 ? '✓ The one tracked frame has the topology of its grid.'
    : !wrong.length ? `✓ Every one of the ${say(run.tracked.length)} tracked frames has the topology of its grid.`
    : `✗ ${say(wrong.length)} of ${say(run.tracked.length)} frames have another topology than their grid, first ${wrong[0].label}.`;
  if (!run.tracked.length) box.className = 'bad';
}

function tellEnd(run) {
  const untracked = kind => run.frames.filter(f => f.fate === kind);
  const parts = [];
  if (!run.totals) parts.push('The report has no last line: the run was cut off, and what is here is what it had finished.');
  else if (run.totals.complete !== true) parts.push('The run ended early, by an error or a signal: what is here is what it had finished.');
  for (const kind of ['held', 'skipped']) {
    const list = untracked(kind);
    if (list.length) parts.push(`${list.length} ${list.length === 1 ? 'frame was' : 'frames were'} ${kind}, first ${list[0].label}.`);
  }
  byId('ended').textContent = parts.join(' ');
  byId('ended').hidden = !parts.length;
}

function tellTiles(run) {
  const list = name => figures(run, name), whole = run.frames.map(f => secondsOf(f, 'whole')).filter(x => x !== null);
  const events = sum(run.frames.flatMap(f => eventKinds.map(k => countOf(f, k.kind))));
  const kept = mean(list('ids_kept')), crossed = sum(list('self_intersections'));
  const tiles = [
    [say(Math.round(mean(list('triangles_geometric')) ?? 0)), 'geometric triangles a frame'],
    [say(Math.round(mean(list('triangles_mechanical')) ?? 0)), 'mechanical triangles a frame'],
    [say(events), `topology events, ${say(run.tracked.length ? Number((events / run.tracked.length).toPrecision(2)) : null)} a frame`],
    [say(mean(list('min_angle_p5')), '°'), `minimum angle, 5th percentile; worst frame ${say(least(list('min_angle_p5')), '°')}`],
    [say(mean(list('distance_mean_vox'))), 'voxels to the surface, mean'],
    [kept === null ? '–' : `${(100 * kept).toFixed(1)}\u202f%`, 'identities kept a frame'],
    [say(crossed), 'self-intersections left'],
  ];
  if (whole.length) tiles.push([say(sum(whole), 's'), `in all, ${say(mean(whole), 's')} a frame`]);
  for (const [figure, words] of tiles) byId('tiles').append(element('div', { class: 'tile' }, element('b', {}, figure), element('span', {}, words)));
}

function tellSettings(run) {
  for (const [name, value] of Object.entries(run.settings))
    byId('settings').append(element('tr', {}, element('th', {}, name), element('td', {}, value === null ? 'decided by the program' : String(value))));
}

// --- all of it -------------------------------------------------------------------------------------

// Places of events are the grid's; the meshes may have been turned and scaled.
function turned(run, [x, y, z]) {
  const s = numberOr(run.settings.scale) ?? 1, up = run.settings.up;
  return up === 'y' ? [s * x, s * z, -s * y] : up === 'z' ? [s * x, -s * z, s * y] : [s * x, s * y, s * z];
}

function main() {
  const run = readRun();
  tellAbout(run);
  tellVerdict(run);
  tellEnd(run);
  tellTiles(run);
  tellSettings(run);
  for (const id of ['player', 'events-panel', 'plots']) byId(id).hidden = !run.frames.length;
  if (!run.frames.length) return null;
  const cursor = new Cursor(run.frames.length), player = new Player(run, cursor);
  const mark = places => player.viewer?.mark(places.map(p => turned(run, p)));
  makeTimeline(byId('timeline'), run, cursor, (i, kind) => {
    player.pause();
    cursor.go(i);
    mark(placesOf(eventsOf(run.frames[i], kind.kind)));
    listEvents(byId('event-list'), run.frames[i], kind, mark);
  });
  if (run.hasTimings) makePlot(byId('plots'), timesPlot, run, cursor);
  for (const spec of plotTable) makePlot(byId('plots'), spec, run, cursor);
  startViewer(player).then(() => { document.body.dataset.ready = 'true'; });
  return player;
}

const player = main();
