// page.mjs CHROMIUM FOLDER: looks at the pages that page.sh made there. Throws at the first thing that is wrong.
import assert from 'node:assert/strict';
import { createHash } from 'node:crypto';
import { readFileSync } from 'node:fs';
import { createServer } from 'node:http';
import { chromium } from 'playwright-core';

const [executablePath, folder] = process.argv.slice(2);
const lines = name => readFileSync(`${folder}/${name}`, 'utf8').trim().split('\n').map(line => JSON.parse(line));
const frames = lines('balls.report.jsonl').filter(line => line.frame);
const events = lines('balls.events.jsonl').filter(line => line.place);
const kinds = ['mechanical', 'geometric'];
const browser = await chromium.launch({ executablePath, headless: true,
  args: ['--no-sandbox', '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'] });

// The folder, served.
const server = createServer((request, answer) => answer.end(readFileSync(folder + request.url)));
await new Promise(done => server.listen(0, '127.0.0.1', done));
const served = `http://127.0.0.1:${server.address().port}`;

// A page that is ready, and a list of what it complained of or asked for elsewhere.
async function open(name, options = {}, from = `file://${folder}`) {
  const page = await browser.newPage({ viewport: { width: 1280, height: 900 }, ...options }), trouble = [];
  page.setDefaultTimeout(60000);
  page.on('console', m => { if (['error', 'warning'].includes(m.type()) && !/GPU stall|GL Driver/.test(m.text())) trouble.push(m.text()); });
  page.on('pageerror', e => trouble.push(e.stack));
  page.on('request', r => { if (!/^(data|blob):/.test(r.url()) && !r.url().startsWith(from)) trouble.push(`asked for ${r.url()}`); });
  await page.goto(`${from}/${name}`);
  await page.waitForFunction(() => document.body.dataset.ready);
  return { page, trouble };
}

const frameShown = page => page.textContent('#frame');
const trianglesShown = async (page, kind) => Number((await page.textContent(`[data-triangles="${kind}"]`)).replace(/\D/g, ''));

// What the canvas shows, two frames on: it is drawn in the next.
async function picture(page) {
  await page.evaluate(() => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done))));
  return createHash('sha256').update(await page.locator('#view').screenshot()).digest('hex');
}
// The next picture that is, or is not, the one given: a loaded machine draws late.
async function pictureComes(page, given, same) {
  for (let tries = 0; tries < 100; tries++) if ((await picture(page) === given) === same) return;
  assert.fail(same ? 'the picture from before does not come back' : 'the picture stays as it was');
}
const centerOf = async locator => { const b = await locator.boundingBox(); return [b.x + b.width / 2, b.y + b.height / 2]; };

async function assertFrame(page, i) {
  assert.equal(await frameShown(page), `frame ${frames[i].frame}`);
  for (const kind of kinds) assert.equal(await trianglesShown(page, kind), frames[i][`triangles_${kind}`], `${kind} triangles of frame ${frames[i].frame}`);
}

// x, y and z of a PLY's vertices, each sorted.
function sortedPly(path) {
  const bytes = readFileSync(path), end = bytes.indexOf('end_header\n') + 11, head = bytes.subarray(0, end).toString('latin1');
  const n = Number(/element vertex (\d+)/.exec(head)[1]), properties = head.split('element face')[0].match(/property (float|int) /g).length;
  const place = (v, a) => bytes.readFloatLE(end + 4 * (v * properties + a));
  return [0, 1, 2].map(a => Array.from({ length: n }, (_, v) => place(v, a)).sort((p, q) => p - q));
}

// The same of what the viewer shows.
const sortedShown = (page, kind) => page.evaluate(wanted => {
  const pieces = player.viewer.panes.find(p => p.kind === wanted).pieces.filter(p => p.mesh.visible), all = [[], [], []];
  for (const { mesh } of pieces)
    for (let v = 0; v < mesh.geometry.attributes.position.count; v++)
      mesh.getVertexPosition(v, mesh.position.clone()).toArray().forEach((x, a) => all[a].push(x));
  return all.map(list => list.sort((p, q) => p - q));
}, kind);

async function scrubs(page) {
  await page.focus('#scrub');
  for (let i = 0; i < frames.length; i++) {
    await assertFrame(page, i);
    for (const kind of kinds) {
      const ply = sortedPly(`${folder}/balls.${kind}.${frames[i].frame}.ply`), shown = await sortedShown(page, kind);
      for (let a = 0; a < 3; a++) {
        assert.equal(shown[a].length, ply[a].length);
        ply[a].forEach((x, v) => assert.ok(Math.abs(x - shown[a][v]) < 1e-4, `${kind} frame ${frames[i].frame}: ${x} is shown at ${shown[a][v]}`));
      }
    }
    await page.keyboard.press('ArrowRight');
  }
}

async function plays(page) {
  await page.selectOption('#speed', '0.25');
  await page.locator('#scrub').fill('0');
  await page.focus('#play');
  await page.keyboard.press(' ');
  const seen = new Set();
  for (let tries = 0; seen.size < 4 && tries < 600; tries++) {
    seen.add(await frameShown(page));
    await page.waitForTimeout(20);
  }
  assert.ok(seen.size >= 4, `playing showed ${[...seen]}`);
  await page.keyboard.press(' ');
  const stopped = await frameShown(page);
  await page.waitForTimeout(400);
  assert.equal(await frameShown(page), stopped);
}

async function showsWires(page) {
  await page.locator('#scrub').fill('2');
  const plain = await picture(page);
  await page.check('#wireframe');
  await pictureComes(page, plain, false);
  await page.uncheck('#wireframe');
  await pictureComes(page, plain, true);
  await page.click('[data-choice="mechanical"]');
  assert.equal(await page.locator('[data-triangles]').count(), 1);
  await pictureComes(page, plain, false);
  await page.click('[data-choice="both"]');
  await pictureComes(page, plain, true);
}

async function followsPlots(page) {
  const svg = page.locator('[data-plot="angles"] svg');
  await svg.scrollIntoViewIfNeeded();
  const box = await svg.boundingBox(), column = i => box.x + 52 + (i + 0.5) * (box.width - 58) / frames.length;
  await page.mouse.move(column(1), box.y + 60);
  const legend = await page.textContent('[data-plot="components"] .legend');
  assert.match(legend, new RegExp(`components ${frames[1].components}\\D`));
  await page.mouse.click(column(3), box.y + 60);
  await assertFrame(page, 3);
  await page.mouse.move(0, 0);
}

async function goesToEvents(page) {
  const event = events[0], dot = page.locator(`[data-frame="${event.frame}"][data-kind="${event.kind}"]`);
  await dot.scrollIntoViewIfNeeded();
  await page.mouse.click(...await centerOf(dot));
  await assertFrame(page, frames.findIndex(f => f.frame === event.frame));
  assert.equal(await page.locator('#event-list tbody tr').count(), events.filter(e => e.frame === event.frame && e.kind === event.kind).length);
  const marked = await page.evaluate(() => [...player.viewer.panes[0].marks.geometry.attributes.position.array]);
  const [x, y, z] = event.place; // --up y --scale 2
  [2 * x, 2 * z, -2 * y].forEach((c, a) => assert.ok(Math.abs(marked[a] - c) < 1e-4, `marked at ${marked.slice(0, 3)}`));
}

async function showsThumbnails(page) {
  await page.waitForFunction(() => document.querySelector('#thumbnails').dataset.ready);
  const colors = await page.evaluate(() => [...document.querySelectorAll('#thumbnails canvas')].map(c =>
    c.getContext('2d').getImageData(0, 0, c.width, c.height).data.filter((_, i) => i % 4 === 3 && _ > 0).length));
  assert.equal(colors.length, frames.length);
  for (const n of colors) assert.ok(n > 200, 'a thumbnail is empty');
}

async function looksAtRun() {
  const { page, trouble } = await open('balls.report.html');
  assert.match(await page.textContent('#verdict'), /Every one of the 6 tracked frames/);
  assert.equal(await page.locator('.plot[data-plot] svg').count(), 11);
  await showsThumbnails(page);
  for (const step of [scrubs, plays, showsWires, followsPlots, goesToEvents]) await step(page);
  assert.deepEqual(trouble, []);
  await page.close();
}

async function fitsNarrowAndDark() {
  const { page, trouble } = await open('balls.report.html', { viewport: { width: 700, height: 900 }, colorScheme: 'dark' });
  assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth), 'the page is wider than its window');
  assert.equal(await page.evaluate(() => getComputedStyle(document.body).backgroundColor), 'rgb(18, 21, 24)');
  assert.deepEqual(trouble, []);
  await page.close();
}

async function fetchesLinkedMeshes() {
  const { page, trouble } = await open('linked.html', {}, served);
  await assertFrame(page, 0);
  assert.deepEqual(trouble, []);
  await page.close();
}

// From a disk the meshes beside a page cannot be read: they are chosen by hand.
async function takesChosenFiles() {
  const { page } = await open('linked.html');
  assert.match(await page.textContent('#stage-note'), /choose them/);
  await page.setInputFiles('#files', kinds.map(kind => `${folder}/balls.${kind}.glb`));
  await page.waitForSelector('#stage:not([hidden])');
  await assertFrame(page, 0);
  await page.close();
}

async function tellsOfAnEarlyEnd() {
  const { page, trouble } = await open('cut.report.html');
  assert.match(await page.textContent('#ended'), /the run was cut off/);
  assert.equal(await page.getAttribute('#scrub', 'max'), '2');
  assert.deepEqual(trouble, []);
  await page.close();
}

async function unpacksMeshes() {
  const { page, trouble } = await open('packed.report.html');
  await showsThumbnails(page);
  for (const i of frames.keys()) {
    await page.locator('#scrub').fill(String(i));
    await assertFrame(page, i);
  }
  assert.deepEqual(trouble, []);
  await page.close();
}

// Frames 1 and 3 show nothing, and the others keep their places in time.
async function showsSkippedFramesEmpty() {
  const { page, trouble } = await open('skip.report.html');
  assert.match(await page.textContent('#ended'), /2 frames were skipped, first 0001/);
  for (const [i, f] of lines('skip.report.jsonl').filter(line => line.frame).entries()) {
    await page.locator('#scrub').fill(String(i));
    for (const kind of kinds) assert.equal(await trianglesShown(page, kind), f[`triangles_${kind}`] ?? 0, `${kind} of frame ${f.frame}`);
  }
  assert.deepEqual(trouble, []);
  await page.close();
}

for (const look of [looksAtRun, fitsNarrowAndDark, fetchesLinkedMeshes, takesChosenFiles, tellsOfAnEarlyEnd, unpacksMeshes, showsSkippedFramesEmpty]) {
  await look();
  console.log(`${look.name}: good`);
}
await browser.close();
server.close();
