// The picture of levels of detail: what coarser and finer bodies of one creature keep, over what they cost.
const kWidth = 790, kHeight = 396, kTop = 94, kBottom = 52, kPanel = 290, kLefts = [64, 464]; // [px]
const kColours = ['#1f6fb4', '#d2691e', '#2c9a4b', '#a033cc', '#b5372f', '#7a6a1f'];

const px = (value) => Number(value.toFixed(1));
const escaped = (text) => text.replace(/[<>&"]/g, (letter) => ({'<': '&lt;', '>': '&gt;', '&': '&amp;', '"': '&quot;'})[letter]);

/** Round steps from 0 to at least `most`, at most six. */
function ticks_to(most) {
  const power = 10 ** Math.floor(Math.log10(most));
  const step = [0.2, 0.5, 1, 2, 5].map((part) => part * power).find((candidate) => most / candidate <= 5.001);
  return Array.from({length: Math.ceil(most / step - 1e-9) + 1}, (_, k) => Number((k * step).toPrecision(6)));
}

/** 1, 2 and 5 times powers of ten around the values. */
function log_ticks(values) {
  const [low, high] = [Math.min(...values), Math.max(...values)];
  const all = [-2, -1, 0, 1, 2, 3, 4].flatMap((power) => [1, 2, 5].map((part) => part * 10 ** power));
  const first = all.findLastIndex((tick) => tick <= low), last = all.findIndex((tick) => tick >= high);
  return all.slice(Math.max(first, 0), last + 1).map((tick) => Number(tick.toPrecision(6)));
}

/** One diagram: `value_of` a row in percent, or null where it has none. */
function panel(rows, creatures, left, x_ticks, y_label, value_of) {
  const most = Math.max(...rows.map((row) => value_of(row) ?? 0), 1);
  const y_ticks = ticks_to(most);
  const [low, high] = [Math.log(x_ticks[0]), Math.log(x_ticks.at(-1))];
  const x = (work) => px(left + ((Math.log(work) - low) / (high - low)) * kPanel);
  const y = (value) => px(kHeight - kBottom - (value / y_ticks.at(-1)) * (kHeight - kTop - kBottom));
  const floor = kHeight - kBottom;
  let svg = '';
  for (const tick of x_ticks) {
    svg += `<line x1="${x(tick)}" x2="${x(tick)}" y1="${kTop}" y2="${floor}" stroke="#ddd"/><text x="${x(tick)}" y="${floor + 16}" text-anchor="middle">${tick}</text>\n`;
  }
  for (const tick of y_ticks) {
    svg += `<line x1="${left}" x2="${left + kPanel}" y1="${y(tick)}" y2="${y(tick)}" stroke="#ddd"/><text x="${left - 6}" y="${y(tick) + 4}" text-anchor="end">${tick} %</text>\n`;
  }
  svg += `<text x="${left + kPanel / 2}" y="${kHeight - 14}" text-anchor="middle">counted work [ms for a frame of 1/60 s]</text>\n`;
  svg += `<text transform="translate(${left - 48} ${(kTop + floor) / 2}) rotate(-90)" text-anchor="middle">${y_label}</text>\n`;
  creatures.forEach((creature, k) => {
    const own = rows.filter((row) => row.creature === creature);
    const places = own.map((row) => (value_of(row) === null ? null : [x(row.work_ms), y(value_of(row)), row]));
    const pieces = places.map((place, n) => (place ? `${places[n - 1] ? 'L' : 'M'}${place[0]} ${place[1]}` : '')).join('');  // a fall breaks the line
    svg += `<path fill="none" stroke="${kColours[k % kColours.length]}" stroke-width="1.5" d="${pieces}"/>\n`;
    for (const [a, b, row] of places.filter(Boolean)) {
      const about = `<title>${escaped(creature)}, ${row.nodes} nodes: ${value_of(row).toFixed(1)} %</title>`;
      svg += `<circle cx="${a}" cy="${b}" r="3.5" fill="${kColours[k % kColours.length]}">${about}</circle>`;
      if (row.nodes === row.solved_nodes) svg += `<circle cx="${a}" cy="${b}" r="7" fill="none" stroke="${kColours[k % kColours.length]}"/>`;
      svg += '\n';
    }
    for (const row of own.filter((other) => other.falls)) {
      svg += `<text x="${x(row.work_ms)}" y="${kTop + 12}" text-anchor="middle" font-size="14" fill="${kColours[k % kColours.length]}">&#215;<title>${escaped(creature)}, ${row.nodes} nodes: falls</title></text>\n`;
    }
  });
  return svg;
}

/** rows: creature, nodes, solved_nodes, work_ms, falls, clip_shape_rms_length, way; numbers, or text of numbers. */
export function levels_svg(told) {
  const number = (value) => (value === '' ? '' : Number(value));
  const rows = told.map((row) => Object.fromEntries(Object.entries(row).map(([name, value]) => [name, name === 'creature' ? value : number(value)])));
  const creatures = [...new Set(rows.map((row) => row.creature))];
  const x_ticks = log_ticks(rows.map((row) => row.work_ms));
  const share = (name) => (row) => (row[name] === '' ? null : 100 * row[name]);
  let svg = `<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 ${kWidth} ${kHeight}" role="img" font-family="sans-serif" font-size="11">` +
    '<rect width="100%" height="100%" fill="#fff"/>\n<text x="8" y="20" font-size="14" font-weight="bold">Levels of detail: one solved creature on coarser and finer bodies</text>\n' +
    '<text x="8" y="38">To the right a body has more nodes and costs more. Left, lower is nearer to the clip; right, 100 % keeps all of its way.</text>\n' +
    '<text x="8" y="53">Ringed: the body that the signals were solved on. &#215;: it falls.</text>\n';
  let along = 8;
  creatures.forEach((creature, k) => {
    svg += `<circle cx="${along + 4}" cy="71" r="4" fill="${kColours[k % kColours.length]}"/><text x="${along + 12}" y="75">${escaped(creature)}</text>\n`;
    along += 40 + 6.2 * creature.length;
  });
  svg += panel(rows, creatures, kLefts[0], x_ticks, 'skin from the clip [% of L, RMS]', share('clip_shape_rms_length'));
  svg += panel(rows, creatures, kLefts[1], x_ticks, "travel [% of the clip's]", share('way'));
  return `${svg}</svg>\n`;
}
