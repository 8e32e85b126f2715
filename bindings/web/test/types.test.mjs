// The package's types, compiled as a project of its own would: strict, with the libraries that most name.
import { execFileSync, spawnSync } from 'node:child_process';
import { copyFileSync, mkdirSync, mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { test } from 'node:test';

import { root } from './common.mjs';

const hasCompiler = spawnSync('tsc', ['--version']).status === 0;

test('a project in TypeScript compiles', { skip: !hasCompiler && 'tsc is not installed (tools/setup.sh web)' }, () => {
  const project = mkdtempSync(join(tmpdir(), 'nifkit-'));
  try {
    const installed = join(project, 'node_modules', 'nifkit');
    mkdirSync(installed, { recursive: true });
    for (const name of ['index.d.ts', 'package.json']) copyFileSync(new URL(`build/web/nifkit/${name}`, root), join(installed, name));
    copyFileSync(new URL('types.ts', import.meta.url), join(project, 'types.ts'));
    execFileSync('tsc', ['--noEmit', '--strict', '--target', 'es2022', '--module', 'esnext', '--moduleResolution', 'node', '--lib', 'es2022,dom', 'types.ts'], {
      cwd: project, // what it finds wrong is said on its standard output
      stdio: ['ignore', 'inherit', 'inherit'],
    });
  } finally {
    rmSync(project, { recursive: true });
  }
});
