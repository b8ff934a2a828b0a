// The picture of survival: of each clip's bodies the share that is still up, over the time.
const kWidth = 790, kTop = 62, kAcross = 5, kPanel = 128, kHigh = 74, kGap = 24, kRow = 128, kLeft = 16; // [px]
const kUp = '#1f6fb4', kFalling = '#b5372f';

const px = (value) => Number(value.toFixed(1));

/** One clip: a step down at each fall. The time is shown by its logarithm, for falls come early and runs are long. */
function panel({name, fall_times_s, bodies, asked_s}, left, top) {
  const from = 0.1, x = (time) => px(left + (Math.log(Math.max(time, from) / from) / Math.log(asked_s / from)) * kPanel);
  const y = (share) => px(top + (1 - share) * kHigh);
  const falls = [...fall_times_s].sort((a, b) => a - b);
  let path = `M${left} ${y(1)}`;
  falls.forEach((time, k) => (path += `H${x(time)}V${y(1 - (k + 1) / bodies)}`));
  path += `H${left + kPanel}`;
  let svg = `<text x="${left}" y="${top - 8}" font-weight="bold">${name}</text>` +
    `<text x="${left + kPanel}" y="${top - 8}" text-anchor="end">${bodies - falls.length} of ${bodies} up</text>\n` +
    `<rect x="${left}" y="${top}" width="${kPanel}" height="${kHigh}" fill="none" stroke="#ddd"/>\n`;
  for (const tick of [0.1, 1, 10, 100].filter((time) => time < 0.9 * asked_s)) {
    const label = `<text x="${x(tick)}" y="${top + kHigh + 13}" text-anchor="middle">${tick}</text>`;
    const runs_into_the_end = x(tick) > left + 0.7 * kPanel;
    svg += `<line x1="${x(tick)}" x2="${x(tick)}" y1="${top}" y2="${top + kHigh}" stroke="#ddd"/>${runs_into_the_end ? "" : label}\n`;
  }
  svg += `<text x="${left + kPanel}" y="${top + kHigh + 13}" text-anchor="end">${Number(asked_s.toPrecision(2))} s</text>\n`;
  return `${svg}<path fill="none" stroke="${falls.length > 0 ? kFalling : kUp}" stroke-width="2" d="${path}"/>\n`;
}

/** clips: name, fall_times_s, bodies, asked_s (how long each run was to last). */
export function survival_svg(clips) {
  const rows = Math.ceil(clips.length / kAcross), height = kTop + rows * kRow;
  let svg = `<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 ${kWidth} ${height}" role="img" font-family="sans-serif" font-size="10">` +
    '<rect width="100%" height="100%" fill="#fff"/>\n<text x="8" y="20" font-size="14" font-weight="bold">Survival: bodies off the plan that are still up</text>\n' +
    '<text x="8" y="36" font-size="11">From top (all) to bottom (none), over the seconds on a logarithmic scale, to the end of what was asked.</text>\n';
  clips.forEach((clip, k) => (svg += panel(clip, kLeft + (k % kAcross) * (kPanel + kGap), kTop + 14 + Math.floor(k / kAcross) * kRow)));
  return `${svg}</svg>\n`;
}
