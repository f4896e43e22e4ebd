// node validate.mjs FILE...   The Khronos validator over each .glb or .gltf, a line a file; exit 1 on any error or warning.
import validator from 'gltf-validator';
import fs from 'fs';
import path from 'path';

async function validate(file) {
  const folder = path.dirname(file);
  const report = await validator.validateBytes(new Uint8Array(fs.readFileSync(file)), {
    uri: path.basename(file),
    maxIssues: 0, // all
    writeTimestamp: false,
    externalResourceFunction: uri =>
      fs.promises.readFile(path.join(folder, decodeURIComponent(uri))).then(bytes => new Uint8Array(bytes)),
  });
  const { numErrors, numWarnings, messages } = report.issues;
  const first = messages.find(m => m.severity < 2); // 0 error, 1 warning
  const why = first ? `: ${first.code} at ${first.pointer}: ${first.message}` : '';
  console.log(`${path.basename(file)}: ${numErrors} errors, ${numWarnings} warnings, ` +
    `${report.info?.animationCount ?? 0} animations, ${report.info?.totalTriangleCount ?? 0} triangles${why}`);
  return numErrors + numWarnings === 0;
}

let bad = process.argv.length < 3;
if (bad) console.log('usage: node validate.mjs FILE...');
for (const file of process.argv.slice(2)) {
  try {
    if (!(await validate(file))) bad = true;
  } catch (error) {
    console.log(`${path.basename(file)}: ${error.message ?? error}`);
    bad = true;
  }
}
process.exit(bad ? 1 : 0);
