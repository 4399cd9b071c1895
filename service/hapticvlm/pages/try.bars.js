// Finds the uniform bars beside a picture: the same method, with the same constants, as vision/bars.py, which explains
// it. Pure.
const UNIFORM = 10; // grey levels within a row of a bar
const DIFFERS = 12; // grey levels from the bar's colour of a pixel of the picture
const ACROSS = 0.6; // share of the pixels beside a bar that must differ from it
const EDGE = 17; // px within which JPEG blurs the line between bar and picture
const LEAST = 0.02; // of the side that a bar covers
const MOST = 0.7; // of the side that both cover
const UNEQUAL = 0.04; // of the side by which the two may differ
const CHANNELS = [0, 1, 2];

// Returns what lies between the bars of RGBA pixels as {left, top, right, bottom}, px; null if there are none.
export function contentBox(data, width, height) {
  const rows = between(height, width, (row, at) => 4 * (row * width + at));
  const [top, bottom] = rows ?? [0, height];
  const columns = between(width, bottom - top, (column, at) => 4 * ((top + at) * width + column));
  if (!rows && !columns) return null;
  const [left, right] = columns ?? [0, width];
  return { left, top, right, bottom };

  // Returns the first and the last row, exclusive, between two bars of `count` rows of `length` pixels.
  function between(count, length, place) {
    const last = (row, at) => place(count - 1 - row, at);
    const colour = range(0, place).map(([low, high]) => (low + high) >> 1);
    const widths = [bar(place), bar(last)];
    const together = widths[0] + widths[1];
    if (Math.min(...widths) < Math.max(2, LEAST * count) || together > MOST * count) return null;
    if (Math.abs(widths[0] - widths[1]) > Math.max(2, UNEQUAL * count)) return null;
    const above = edge(widths[0], place);
    const below = edge(widths[1], last);
    return above === null || below === null ? null : [above, count - below];

    // Returns the lowest and the highest level of each channel of a row.
    function range(row, where) {
      const ends = CHANNELS.map(() => [255, 0]);
      for (let at = 0; at < length; at++) {
        for (const channel of CHANNELS) {
          const level = data[where(row, at) + channel];
          ends[channel] = [Math.min(ends[channel][0], level), Math.max(ends[channel][1], level)];
        }
      }
      return ends;
    }

    function bar(where) {
      let row = 0;
      while (row < count && range(row, where).every(([low, high], channel) => high - low <= UNIFORM && Math.abs(((low + high) >> 1) - colour[channel]) <= UNIFORM)) row++;
      return row;
    }

    // Returns the first row of the picture; null if it differs from the bar in parts only.
    function edge(first, where) {
      for (let row = first; row < Math.min(first + EDGE, count); row++) {
        let away = 0;
        for (let at = 0; at < length; at++) away += CHANNELS.some((channel) => Math.abs(data[where(row, at) + channel] - colour[channel]) > DIFFERS);
        if (away / length >= ACROSS) return row;
      }
      return null;
    }
  }
}
