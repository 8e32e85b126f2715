// Files from users: dropped, or chosen.

/** Sorts a list of files into { asset, triangles }. Throws a sentence if the list makes no sense. */
export function sorted(files) {
  const kinds = {};
  for (const file of files) {
    const ending = /\.(nif|glb)$/i.exec(file.name)?.[1].toLowerCase();
    if (!ending) throw new Error(`${file.name} is neither a .nif nor a .glb.`);
    const kind = ending === 'nif' ? 'asset' : 'triangles';
    if (kinds[kind]) throw new Error(`There are two .${ending} files; one is shown at a time.`);
    kinds[kind] = file;
  }
  return kinds;
}

/** Calls onFiles(files) for files that are dropped on the page or chosen; shows `hint` while files are dragged over it. */
export function listen({ hint, choose, input }, onFiles) {
  const hasFiles = (event) => event.dataTransfer?.types.includes('Files');
  let inside = 0;
  const show = (change) => {
    inside = Math.max(0, inside + change);
    hint.hidden = inside === 0;
  };
  addEventListener('dragenter', (event) => hasFiles(event) && show(1));
  addEventListener('dragleave', (event) => hasFiles(event) && show(-1));
  addEventListener('dragover', (event) => hasFiles(event) && event.preventDefault());
  addEventListener('drop', (event) => {
    if (!hasFiles(event)) return;
    event.preventDefault();
    show(-Infinity);
    onFiles([...event.dataTransfer.files]);
  });
  choose.addEventListener('click', () => input.click());
  input.addEventListener('change', () => {
    const files = [...input.files];
    input.value = ''; // so that the same file can be chosen again
    if (files.length > 0) onFiles(files);
  });
}

/** Whether two engines probably have the same object: their boxes agree to within a fiftieth. */
export function areAlike(a, b) {
  const size = Math.max(a.info.longest, b.info.longest);
  return a.info.bounds.every((corner, i) => corner.every((value, axis) => Math.abs(value - b.info.bounds[i][axis]) <= size / 50));
}
