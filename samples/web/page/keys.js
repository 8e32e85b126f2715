// The keyboard. If the focused element handles a key itself, it gets it.

const kSunStep = 5; // degrees
const kTurnStep = 0.1; // radians

/** actions: sun(azimuth, elevation), turn(azimuth, polar, factor), toggle(), open(), reset(). */
export function listenToKeys(actions) {
  const keys = {
    ArrowLeft: () => actions.sun(-kSunStep, 0),
    ArrowRight: () => actions.sun(kSunStep, 0),
    ArrowUp: () => actions.sun(0, kSunStep),
    ArrowDown: () => actions.sun(0, -kSunStep),
    a: () => actions.turn(-kTurnStep, 0, 1),
    d: () => actions.turn(kTurnStep, 0, 1),
    w: () => actions.turn(0, -kTurnStep, 1),
    s: () => actions.turn(0, kTurnStep, 1),
    '+': () => actions.turn(0, 0, 0.9),
    '=': () => actions.turn(0, 0, 0.9),
    '-': () => actions.turn(0, 0, 1 / 0.9),
    t: actions.toggle,
    o: actions.open,
    r: actions.reset,
  };
  addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    if (!Object.hasOwn(keys, key)) return;
    // Arrows choose among radio buttons, and scroll the text.
    if (key.startsWith('Arrow') && event.target.closest?.('#panel')) return;
    event.preventDefault();
    keys[key]();
  });
}
