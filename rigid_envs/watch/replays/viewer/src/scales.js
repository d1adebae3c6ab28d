// Colours, and numbers on axes.

// Okabe and Ito: told apart by colour-blind eyes too.
export const COLORS = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9"];

// Lines of the first, second ... episode.
export const DASHES = [[], [5, 3], [2, 2], [9, 3, 2, 3]];

// The same as a background of style sheets.
export function lineSample(episode, color) {
  if (!episode) return color;
  let at = 0;
  const parts = DASHES[episode].map((length, k) => {
    const part = `${k % 2 ? "transparent" : color} ${at}px ${at + length}px`;
    at += length;
    return part;
  });
  return `repeating-linear-gradient(90deg, ${parts.join(", ")})`;
}

// Round numbers between two ends: about `count`, and never fewer than two.
export function niceTicks(low, high, count) {
  for (let wanted = count; wanted < 4 * count; wanted++) {
    const ticks = ticksFor(low, high, wanted);
    if (ticks.length > 1) return ticks;
  }
  return ticksFor(low, high, 4 * count);
}

function ticksFor(low, high, count) {
  const rough = (high - low) / count;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].find((factor) => factor * power >= rough) * power;
  const ticks = [];
  for (let k = Math.ceil(low / step); k * step <= high + 1e-9 * step; k++) ticks.push(k * step || 0);
  return ticks;
}

// A number of an axis, with as many digits as its neighbours need.
export function readable(value, ticks) {
  const largest = Math.max(...ticks.map(Math.abs));
  const step = ticks.length > 1 ? ticks[1] - ticks[0] : largest || 1;
  if (value === 0) return "0";
  if (largest < 1e-3 || largest >= 1e5) {
    const power = Math.floor(Math.log10(largest) + 1e-9);
    const digits = Math.max(0, power - Math.floor(Math.log10(step) + 1e-9));
    return `${(value / 10 ** power).toFixed(digits)}e${power}`;
  }
  return value.toFixed(Math.max(0, -Math.floor(Math.log10(step) + 1e-9)));
}
