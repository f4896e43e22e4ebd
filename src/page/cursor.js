'use strict';
// cursor.js: the frame at hand and the one looked at, which all plots, the timeline and the viewer share.

class Cursor extends EventTarget {
  constructor(count) {
    super();
    this.count = count;
    this.frame = 0;   // index of the frame at hand
    this.look = null; // index of the frame under the pointer
  }

  // The frame whose numbers are shown.
  get shown() { return this.look ?? this.frame; }

  go(frame) {
    const next = Math.max(0, Math.min(this.count - 1, frame));
    if (next === this.frame) return;
    this.frame = next;
    this.dispatchEvent(new Event('go'));
    this.dispatchEvent(new Event('change'));
  }

  lookAt(frame) {
    if (frame === this.look) return;
    this.look = frame;
    this.dispatchEvent(new Event('change'));
  }
}

// Frames side by side along x, in columns of one width; shared by plots and timeline.
class Columns {
  constructor(count, left, right) {
    Object.assign(this, { count, left, right, width: (right - left) / count });
  }
  middle(i) { return this.left + (i + 0.5) * this.width; }
  at(x) { return Math.max(0, Math.min(this.count - 1, Math.floor((x - this.left) / this.width))); }
}

// As many labels as fit, at round steps.
function labelFrames(svg, columns, frames, y) {
  const wanted = 7 * greatest(frames.map(f => f.label.length)) + 18;
  const step = [1, 2, 5, 10, 20, 25, 50, 100, 200, 250, 500, 1000, 2000, 5000, 10000].find(s => s * columns.width >= wanted) ?? frames.length;
  for (let i = 0; i < frames.length; i += step)
    svg.append(svgElement('text', { x: columns.middle(i), y, 'text-anchor': 'middle' }, frames[i].label));
}

// Pressing and dragging takes the frame along; pointing looks at it. `columns` are asked for at each event: they change with the size.
function followPointer(svg, cursor, columns) {
  const frameOf = event => columns().at(event.clientX - svg.getBoundingClientRect().left);
  svg.addEventListener('pointerdown', event => { svg.setPointerCapture(event.pointerId); cursor.go(frameOf(event)); });
  svg.addEventListener('pointermove', event => {
    cursor.lookAt(frameOf(event));
    if (event.buttons & 1) cursor.go(frameOf(event));
  });
  svg.addEventListener('pointerleave', () => cursor.lookAt(null));
}

// The two upright lines; returns what puts them in their places.
function cursorLines(svg, cursor, columns, top, bottom) {
  const lines = ['cursor', 'look'].map(name => svg.appendChild(svgElement('line', { class: name, y1: top, y2: bottom })));
  return () => [cursor.frame, cursor.look].forEach((frame, i) => {
    lines[i].style.display = frame === null ? 'none' : '';
    if (frame === null) return;
    const x = Math.round(columns.middle(frame)) + 0.5;
    lines[i].setAttribute('x1', x);
    lines[i].setAttribute('x2', x);
  });
}

// Frames without a mesh of their own are shaded, and those of another topology than their grid's; no narrower than can be seen.
function shadeFrames(svg, columns, frames, top, bottom) {
  const width = Math.max(1.5, columns.width);
  frames.forEach((f, i) => {
    const shade = f.fate !== 'tracked' ? 'untracked' : f.figure('wrong_components') > 0 ? 'wrong' : null;
    if (!shade) return;
    const box = svgElement('rect', { class: shade, x: columns.middle(i) - width / 2, y: top, width, height: bottom - top });
    box.append(svgElement('title', {}, `frame ${f.label}: ${shade === 'wrong' ? 'another topology than its grid' : f.fate}`));
    svg.append(box);
  });
}
