'use strict';
// player.js: plays the run: the viewer, its controls, and the time they share.

const byId = id => document.getElementById(id);

class Player {
  constructor(run, cursor) {
    Object.assign(this, { run, cursor, viewer: null, up: 'z', time: 0, last: null, request: 0, stepping: false });
    const scrub = byId('scrub');
    scrub.max = run.frames.length - 1;
    scrub.addEventListener('input', () => { this.pause(); cursor.go(Number(scrub.value)); });
    byId('play').addEventListener('click', () => this.toggle());
    document.addEventListener('keydown', event => this.key(event));
    cursor.addEventListener('go', () => this.follow());
    this.tell();
  }

  get isPlaying() { return this.last !== null; }
  get end() { return this.run.frames.at(-1).time + 1 / this.run.fps; }

  // A frame was gone to: by the player itself, or by somebody else.
  follow() {
    if (!this.stepping) {
      this.time = this.run.frames[this.cursor.frame].time;
      this.show();
      this.viewer?.mark([]);
    }
    this.tell();
  }

  show() {
    const triangles = this.viewer?.show(this.time) ?? {};
    for (const [kind, n] of Object.entries(triangles)) {
      const readout = document.querySelector(`[data-triangles="${kind}"]`);
      if (readout) readout.textContent = say(n);
    }
  }

  tell() {
    const f = this.run.frames[this.cursor.frame];
    byId('scrub').value = this.cursor.frame;
    byId('frame').textContent = `frame ${f.label}${f.fate === 'tracked' ? '' : `, ${f.fate}`}`;
    const thumbnails = [...byId('thumbnails').children];
    const at = thumbnails.findLast(t => Number(t.dataset.index) <= this.cursor.frame);
    for (const t of thumbnails) t.toggleAttribute('aria-current', false);
    at?.setAttribute('aria-current', 'true');
  }

  toggle() { this.isPlaying ? this.pause() : this.play(); }

  play() {
    byId('play').textContent = 'Pause';
    this.viewer?.mark([]);
    this.last = performance.now();
    if (this.cursor.frame === this.run.frames.length - 1) this.time = 0;
    this.request = requestAnimationFrame(now => this.step(now));
  }

  pause() {
    byId('play').textContent = 'Play';
    this.last = null;
    cancelAnimationFrame(this.request);
  }

  step(now) {
    this.time += Math.max(0, now - this.last) / 1000 * Number(byId('speed').value);
    this.last = now;
    if (this.time >= this.end) this.time = 0;
    this.stepping = true;
    this.cursor.go(Math.max(0, this.run.frames.findLastIndex(f => f.time <= this.time)));
    this.stepping = false;
    this.show();
    this.request = requestAnimationFrame(next => this.step(next));
  }

  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || /^(SELECT|TEXTAREA)$/.test(event.target.tagName)) return;
    const act = {
      ' ': () => this.toggle(), w: () => byId('wireframe').click(), f: () => byId('fit').click(),
      ArrowLeft: () => { this.pause(); this.cursor.go(this.cursor.frame - 1); }, ArrowRight: () => { this.pause(); this.cursor.go(this.cursor.frame + 1); },
    }[event.key];
    if (!act || (event.key === ' ' && event.target.tagName === 'SUMMARY')) return;
    event.preventDefault();
    act();
  }

  // The viewer with its meshes is there.
  take(viewer) {
    this.viewer = viewer;
    this.up = this.run.settings.up === 'y' ? 'y' : 'z';
    byId('stage').hidden = false;
    byId('player').classList.remove('no-view');
    makeChoice(byId('kinds'), [...(viewer.panes.length > 1 ? ['both'] : []), ...viewer.panes.map(p => p.kind)], 0, kind => {
      viewer.kinds = kind === 'both' ? [...meshKinds] : [kind];
      this.caption();
    });
    makeChoice(byId('ups'), ['z', 'y'], this.up === 'z' ? 0 : 1, up => { this.up = up; viewer.fit(up); }, ' up');
    byId('wireframe').addEventListener('change', event => { viewer.wireframe = event.target.checked; this.show(); });
    byId('fit').addEventListener('click', () => viewer.fit(this.up));
    this.caption();
    viewer.fit(this.up);
    this.time = this.run.frames[this.cursor.frame].time;
    this.show();
    viewer.draw();
    this.drawThumbnails();
  }

  caption() {
    byId('captions').replaceChildren(...this.viewer.shownPanes.map(p =>
      element('div', {}, element('b', {}, p.kind), ' · ', element('span', { 'data-triangles': p.kind }), ' triangles')));
    this.show();
  }

  // A few frames, evenly spread; one at each turn, so that the page stays alive.
  async drawThumbnails() {
    const frames = this.run.frames, n = Math.min(8, frames.length), kind = this.viewer.panes.at(-1).kind;
    for (let k = 0; k < n; k++) {
      const index = n === 1 ? 0 : Math.round(k * (frames.length - 1) / (n - 1));
      const canvas = element('canvas', { width: 240, height: 160 });
      const button = element('button', { type: 'button', 'data-index': index }, canvas, element('span', {}, frames[index].label));
      button.addEventListener('click', () => { this.pause(); this.cursor.go(index); });
      this.viewer.drawInto(canvas, kind, frames[index].time);
      byId('thumbnails').append(button);
      await new Promise(requestAnimationFrame);
    }
    this.tell();
    byId('thumbnails').dataset.ready = 'true';
  }
}

// Buttons of which one is pressed.
function makeChoice(host, names, first, choose, behind = '') {
  const buttons = names.map(name => element('button', { type: 'button', 'data-choice': name, 'aria-pressed': 'false' }, name + behind));
  buttons.forEach((button, i) => button.addEventListener('click', () => {
    for (const b of buttons) b.setAttribute('aria-pressed', String(b === button));
    choose(names[i]);
  }));
  buttons[first].setAttribute('aria-pressed', 'true');
  host.replaceChildren(...(names.length > 1 ? buttons : []));
}

function tellStage(text) {
  byId('stage-note').textContent = text;
  byId('stage-note').hidden = !text;
}

async function openViewer(player, load) {
  const viewer = globalThis.makeViewer(byId('view'));
  for (const kind of meshKinds) {
    const bytes = await load(kind);
    if (bytes) await viewer.add(kind, bytes);
  }
  if (!viewer.panes.length) throw new Error('no mesh');
  tellStage(missingMeshes().join(' '));
  player.take(viewer);
}

// A page opened from a disk may not read its neighbours: they can be chosen by hand.
function offerChoice(player) {
  tellStage('The meshes lie beside this page, and a browser does not let a page opened from a disk read them. Serve the folder, or choose them.');
  byId('stage-choose').hidden = false;
  byId('files').addEventListener('change', async event => {
    const file = kind => [...event.target.files].find(f => f.name.endsWith(`.${kind}.glb`));
    if (!meshKinds.some(file)) return tellStage('None of these is a mesh of this run: their names end in .mechanical.glb and .geometric.glb.');
    byId('stage-choose').hidden = true;
    openViewer(player, async kind => file(kind)?.arrayBuffer()).catch(tellTrouble);
  });
}

function tellTrouble(error) {
  tellStage(`The viewer cannot show the meshes: ${error.message}.`);
}

async function startViewer(player) {
  const held = meshKinds.filter(kind => partsOf(kind).some(p => !('missing' in p.dataset)));
  byId('player').classList.add('no-view');
  if (!globalThis.makeViewer) return tellStage('This build of twinmesh has no viewer: it was made without npm. The plots below are whole.');
  if (!held.length) return tellStage(missingMeshes().join(' '));
  tellStage('Unpacking the meshes …');
  try {
    await openViewer(player, loadMesh);
  } catch (error) {
    if (held.some(kind => partsOf(kind)[0]?.dataset.link)) offerChoice(player);
    else tellTrouble(error);
  }
}
