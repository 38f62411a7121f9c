// Unpacks the samples (see samples.py) and finds values and extremes in them.

async function unpack(text) {
  const packed = Uint8Array.from(atob(text), c => c.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

function decode(bytes, at, count, {low, step}) {
  const values = new Float64Array(count);
  for (let i = 0, code = 0; i < count; i++) {
    const k = at + i;
    code = (code + (bytes[k] | bytes[k + count] << 8 | bytes[k + 2 * count] << 16 | bytes[k + 3 * count] << 24)) >>> 0;
    values[i] = code ? low + (code - 1) * step : NaN;
  }
  return values;
}

class Times {
  constructor({count, start, step}, values) {
    Object.assign(this, {count, start, step, values});
  }
  at(i) { return this.values ? this.values[i] : this.start + i * this.step; }
  get end() { return this.count ? this.at(this.count - 1) : this.start; }
  // Index of the last sample at or before a time; 0 before the first.
  index(time) {
    if (!this.values) {
      const i = this.step ? Math.floor((time - this.start) / this.step + 1e-6) : 0;
      return Math.max(0, Math.min(this.count - 1, i));
    }
    let low = 0, high = this.count - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (this.values[middle] <= time + 1e-9) low = middle; else high = middle - 1;
    }
    return low;
  }
}

class Series {
  constructor(times, values) { Object.assign(this, {times, values}); }
  covers(time) { return time >= this.times.start - 1e-9 && time <= this.times.end + 1e-9; }
  value(time) { return this.covers(time) ? this.values[this.times.index(time)] : NaN; }
  // On the straight line between two samples, for drawing motion.
  between(time) {
    const {times, values} = this, i = times.index(time), j = Math.min(i + 1, times.count - 1);
    const width = times.at(j) - times.at(i);
    const share = width > 0 ? Math.max(0, Math.min(1, (time - times.at(i)) / width)) : 0;
    return values[i] + share * (values[j] - values[i]);
  }
  // Samples between two times; where they are more than two per pixel, the extremes of each pixel in their order.
  visible(from, to, pixels) {
    const {times, values} = this, x = [], y = [];
    if (!times.count) return {x, y};
    const first = Math.max(0, times.index(from) - 1), last = Math.min(times.count - 1, times.index(to) + 2);
    const group = Math.max(1, Math.floor((last - first + 1) / (2 * Math.max(pixels, 50))) * 2);
    if (group < 2) {
      for (let i = first; i <= last; i++) { x.push(times.at(i)); y.push(values[i]); }
      return {x, y};
    }
    for (let i = first; i <= last; i += group) {
      const end = Math.min(last + 1, i + group);
      let low = -1, high = -1, gap = -1;
      for (let k = i; k < end; k++) {
        const v = values[k];
        if (v !== v) gap = k;
        else {
          if (low < 0 || v < values[low]) low = k;
          if (high < 0 || v > values[high]) high = k;
        }
      }
      const kept = new Set(low < 0 ? [i] : [low, high]);
      if (gap >= 0 && low >= 0 && end - i > 2) kept.add(gap);
      for (const k of [...kept].sort((a, b) => a - b)) { x.push(times.at(k)); y.push(values[k]); }
    }
    return {x, y};
  }
}

async function readSamples(about, text) {
  const bytes = await unpack(text);
  let at = 0;
  const take = (count, coded) => { const values = decode(bytes, at, count, coded); at += 4 * count; return values; };
  const times = about.logs.map(log => new Times(log, log.coded ? take(log.count, log.coded) : null));
  return {times, series: about.series.map(one => new Series(times[one.log], take(times[one.log].count, one)))};
}
