// Pictures of the report as exact values, and how a value becomes a colour. No document, no state of the view.
"use strict";

class ReportData {
  constructor(description) {
    Object.assign(this, description);
    this.count = this.width * this.height;
    this.thresholds = new Float32Array(bytesOf(this.tone_thresholds).buffer);
    this.magma = bytesOf(this.magma);
    this.viridis = bytesOf(this.viridis);
    this.loads = new Map();
  }

  static fromPage() {
    return new ReportData(JSON.parse(document.getElementById("viewer-data").textContent));
  }

  indexOf(name) {
    return this.pictures.findIndex((picture) => picture.name === name);
  }

  // Values of a picture: {radiance: [R, G, B planes of float32], flip, steps: Float32Array or null}. Decoded once.
  load(index) {
    if (!this.loads.has(index)) this.loads.set(index, this.decode(index));
    return this.loads.get(index);
  }

  async decode(index) {
    const picture = this.pictures[index];
    if (!picture.exact) throw new Error(`'${picture.name}' is on this page as thumbnails only`);
    const colors = await inflated(`values-${index}-radiance`, 12 * this.count);
    const radiance = [0, 1, 2].map((channel) => floatPlane(colors, 4 * channel * this.count, this.count));
    const map = async (kind, unit) =>
      picture[kind] ? stepPlane(await inflated(`values-${index}-${kind}`, 2 * this.count), this.count, unit) : null;
    return { radiance, flip: await map("flip", 1 / 65534), steps: await map("steps", this.steps_unit) };
  }

  // 8-bit level of a radiance under `scale`, as the program's preview has it: the number of thresholds not above it.
  level(radiance, scale) {
    const value = Math.fround(radiance * scale);
    let low = 0;
    let high = 255;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.thresholds[middle] <= value) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  // Each painter fills `rgba` (4 bytes a pixel). Values that are not finite are magenta, as in the program.
  paintColors(rgba, values, ev) {
    const [red, green, blue] = values.radiance;
    const scale = exposureScale(ev);
    for (let i = 0, at = 0; i < this.count; ++i, at += 4) {
      const finite = Number.isFinite(red[i]) && Number.isFinite(green[i]) && Number.isFinite(blue[i]);
      rgba[at] = finite ? this.level(red[i], scale) : 255;
      rgba[at + 1] = finite ? this.level(green[i], scale) : 0;
      rgba[at + 2] = finite ? this.level(blue[i], scale) : 255;
      rgba[at + 3] = 255;
    }
  }

  paintDifference(rgba, a, b, ev, gain) {
    const difference = { radiance: [0, 1, 2].map((c) => a.radiance[c].map((value, i) => gain * Math.abs(value - b.radiance[c][i]))) };
    this.paintColors(rgba, difference, ev);
  }

  // Orange where A is brighter, blue where it is darker, by luminance.
  paintSigned(rgba, a, b, ev, gain) {
    const scale = gain * exposureScale(ev);
    for (let i = 0, at = 0; i < this.count; ++i, at += 4) {
      const difference = luminance(a.radiance, i) - luminance(b.radiance, i);
      const level = this.level(Math.abs(difference), scale) / 255;
      const color = !Number.isFinite(difference) ? [255, 0, 255] : difference > 0 ? [255, 158, 61] : [77, 157, 255];
      for (let channel = 0; channel < 3; ++channel) rgba[at + channel] = Number.isFinite(difference) ? Math.round(level * color[channel]) : color[channel];
      rgba[at + 3] = 255;
    }
  }

  // `at(i)` is where a value lies on the scale, 0 to 1, or NaN.
  paintHeat(rgba, table, at) {
    for (let i = 0, byte = 0; i < this.count; ++i, byte += 4) {
      const position = at(i);
      const entry = 3 * Math.round(255 * Math.min(Math.max(position, 0), 1));
      for (let channel = 0; channel < 3; ++channel)
        rgba[byte + channel] = Number.isNaN(position) ? (channel === 1 ? 0 : 255) : table[entry + channel];
      rgba[byte + 3] = 255;
    }
  }

  errorPosition(error) {
    if (!Number.isFinite(error)) return NaN;
    return Math.log(Math.max(error, this.error_low) / this.error_low) / Math.log(this.error_high / this.error_low);
  }
}

function bytesOf(base64) {
  return Uint8Array.from(atob(base64), (character) => character.charCodeAt(0));
}

async function inflated(id, size) {
  const compressed = bytesOf(document.getElementById(id).textContent);
  const stream = new Blob([compressed]).stream().pipeThrough(new DecompressionStream("deflate"));
  const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
  if (bytes.length !== size) throw new Error(`${id} holds ${bytes.length} bytes instead of ${size}`);
  return bytes;
}

// Four runs of `count` bytes, the lowest bytes first, as float32.
function floatPlane(bytes, offset, count) {
  const view = new DataView(new ArrayBuffer(4 * count));
  for (let byte = 0; byte < 4; ++byte)
    for (let i = 0; i < count; ++i) view.setUint8(4 * i + byte, bytes[offset + byte * count + i]);
  const plane = new Float32Array(count);
  for (let i = 0; i < count; ++i) plane[i] = view.getFloat32(4 * i, true);
  return plane;
}

// Two runs of `count` bytes, the low bytes first, times `unit`; 65535 stands for what is not finite.
function stepPlane(bytes, count, unit) {
  const plane = new Float32Array(count);
  for (let i = 0; i < count; ++i) {
    const code = bytes[i] + 256 * bytes[count + i];
    plane[i] = code === 65535 ? NaN : code * unit;
  }
  return plane;
}

// EV100: displayed = radiance / (1.2 x 2^EV), in float32 as the program computes it.
function exposureScale(ev) {
  return Math.fround(1 / Math.fround(Math.fround(1.2) * Math.fround(2 ** ev)));
}

function luminance(radiance, i) {
  return 0.2126 * radiance[0][i] + 0.7152 * radiance[1][i] + 0.0722 * radiance[2][i];
}

// |Y - Y_R| / (|Y_R| + 0.01), as the report defines it.
function relativeError(values, reference, i) {
  const truth = luminance(reference.radiance, i);
  return Math.abs(luminance(values.radiance, i) - truth) / (Math.abs(truth) + 0.01);
}

// The shortest decimal that reads back as the same float32.
function shortestFloat(value) {
  if (!Number.isFinite(value)) return String(value);
  for (let digits = 1; digits < 9; ++digits) {
    const text = value.toPrecision(digits);
    if (Math.fround(Number(text)) === value) return String(Number(text));
  }
  return String(Number(value.toPrecision(9)));
}
