// The README's example works in a project that installed the package as npm packed it.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { copyFileSync, mkdtempSync, readFileSync, readdirSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { test } from 'node:test';
import { fileURLToPath } from 'node:url';

import { golden, root } from './common.mjs';

test('the example runs in a project that has installed the package', () => {
  const readme = readFileSync(new URL('../README.md', import.meta.url), 'utf8');
  const example = readme.match(/```js\n([^]*?)```/)[1];
  const packages = fileURLToPath(new URL('build/web/', root));
  const archive = readdirSync(packages).find((name) => /^nifkit-.*\.tgz$/.test(name));
  const project = mkdtempSync(join(tmpdir(), 'nifkit-'));
  try {
    writeFileSync(join(project, 'package.json'), '{"private": true, "type": "module"}');
    writeFileSync(join(project, 'example.js'), example);
    copyFileSync(golden('v2-exact.nif'), join(project, 'statue.nif'));
    execFileSync('npm', ['install', '--offline', '--no-audit', '--no-fund', '--silent', join(packages, archive)], { cwd: project });
    const said = execFileSync(process.execPath, ['example.js'], { cwd: project, encoding: 'utf8' });
    assert.match(said, /^\d+ of 1000 points see the sun\n$/);
  } finally {
    rmSync(project, { recursive: true });
  }
});
