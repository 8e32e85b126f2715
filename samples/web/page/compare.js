// Gives both engines the same rays, to compare their answers and speeds.

const kPixels = 150000;
const kRounds = 3;

/**
 * Rays of a view as `lit` sees it, asked of each engine of { asset, triangles } that there is. Gives { rays, rates: rays a second
 * by kind, different: answers that differ, if there are two }.
 */
export async function compare(engines, lit, view) {
  const rays = await lit.rays(view, kPixels);
  const count = rays.length / 8;
  const answers = [], rates = {};
  for (const [kind, engine] of Object.entries(engines)) {
    if (!engine || count === 0) continue;
    let best = Infinity;
    for (let round = 0; round < kRounds; ++round) {
      const { visible, milliseconds } = await engine.answer(rays);
      best = Math.min(best, milliseconds);
      if (round === 0) answers.push(visible);
    }
    rates[kind] = (1000 * count) / best;
  }
  let different = 0;
  if (answers.length === 2) for (let i = 0; i < count; ++i) different += answers[0][i] !== answers[1][i];
  return { rays: count, rates, different: answers.length === 2 ? different : undefined };
}
