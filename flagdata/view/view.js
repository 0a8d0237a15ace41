// Films beside their winds, with one cursor for both; the curves of an alignment. Everything is drawn on canvases in the
// colours of the page.
"use strict";

const BATCHES = 6; // of frames that are kept
const NARROW = 46; // px left of a plot, for its numbers

const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

const fetched = async (address, how) => {
  const answer = await fetch(address);
  if (!answer.ok) throw new Error(`${answer.status}`);
  return answer[how]();
};

// Numbers for an axis: about `count` of them, round.
const ticks = (low, high, count) => {
  const rough = (high - low) / count;
  const power = 10 ** Math.floor(Math.log10(rough));
  const factor = [1, 2, 2.5, 5, 10].find((one) => one * power >= rough) ?? 10;
  const step = factor * power;
  const found = [];
  for (let at = Math.ceil(low / step); at * step <= high + 1e-9 * step; at++) found.push(at * step);
  return { found, digits: Math.max(0, -Math.floor(Math.log10(step) + 1e-9) + (factor === 2.5 ? 1 : 0)) };
};

// A line over x with a band around it, and a cursor.
class Plot {
  constructor(canvas, { x, y, low, high, xLabel, yLabel, shade, fromZero, level, range }) {
    Object.assign(this, { canvas, x, y, low, high, xLabel, yLabel, shade, level, at: null });
    const inside = x.map((_, i) => i).filter((i) => !range || (x[i] >= range[0] && x[i] <= range[1]));
    const known = [];
    for (const i of inside) for (const line of [y, low, high]) if (line && line[i] !== null) known.push(line[i]);
    if (level) known.push(level, -level);
    const least = known.reduce((one, other) => Math.min(one, other), known[0] ?? 0);
    const most = known.reduce((one, other) => Math.max(one, other), known[0] ?? 1);
    const margin = (most - least || 1) * 0.06;
    this.yRange = [fromZero ? 0 : least - margin, most + margin];
    const last = x.length ? x[x.length - 1] : 1;
    this.xRange = range ?? [x.length ? x[0] : 0, last];
    if (shade) this.xRange = [Math.min(this.xRange[0], shade[0]), Math.max(this.xRange[1], shade[1])];
    if (this.xRange[0] === this.xRange[1]) this.xRange[1] += 1;
    new ResizeObserver(() => this.resize()).observe(canvas);
  }

  resize() {
    const scale = window.devicePixelRatio || 1;
    const { width, height } = this.canvas.getBoundingClientRect();
    Object.assign(this, { width, height, scale });
    this.canvas.width = Math.round(width * scale);
    this.canvas.height = Math.round(height * scale);
    this.base = document.createElement("canvas");
    this.base.width = this.canvas.width;
    this.base.height = this.canvas.height;
    this.paintBase(this.base.getContext("2d"));
    this.paint();
  }

  px(value) { return NARROW + (value - this.xRange[0]) / (this.xRange[1] - this.xRange[0]) * (this.width - NARROW - 10); }
  py(value) { return this.height - 38 - (value - this.yRange[0]) / (this.yRange[1] - this.yRange[0]) * (this.height - 62); }
  value(px) { return this.xRange[0] + (px - NARROW) / (this.width - NARROW - 10) * (this.xRange[1] - this.xRange[0]); }

  paintBase(pen) {
    pen.scale(this.scale, this.scale);
    pen.font = "12px system-ui, sans-serif";
    const [quiet, rule, link] = ["--quiet", "--rule", "--link"].map(colour);
    const [top, bottom] = [this.py(this.yRange[1]), this.py(this.yRange[0])];
    if (this.shade) {
      pen.fillStyle = link;
      pen.globalAlpha = 0.14;
      const left = this.px(this.shade[0]);
      pen.fillRect(left, top, Math.max(2, this.px(this.shade[1]) - left), bottom - top);
      pen.globalAlpha = 1;
    }
    const ys = ticks(...this.yRange, 5);
    const xs = ticks(...this.xRange, Math.max(2, Math.floor(this.width / 110)));
    pen.strokeStyle = rule;
    pen.fillStyle = quiet;
    pen.textBaseline = "middle";
    pen.textAlign = "right";
    for (const y of ys.found) {
      pen.beginPath(); pen.moveTo(NARROW, this.py(y)); pen.lineTo(this.width - 10, this.py(y)); pen.stroke();
      pen.fillText(y.toFixed(ys.digits), NARROW - 8, this.py(y));
    }
    pen.textAlign = "center";
    for (const x of xs.found) pen.fillText(x.toFixed(xs.digits), this.px(x), bottom + 12);
    pen.textAlign = "left";
    pen.fillText(this.yLabel, 4, 9);
    pen.textAlign = "right";
    pen.fillText(this.xLabel, this.width - 10, this.height - 9);
    pen.save();
    pen.beginPath(); pen.rect(NARROW, top, this.width - NARROW - 10, bottom - top); pen.clip();
    if (this.level) {
      pen.fillStyle = quiet;
      pen.globalAlpha = 0.12;
      pen.fillRect(NARROW, this.py(this.level), this.width - NARROW, this.py(-this.level) - this.py(this.level));
      pen.globalAlpha = 1;
    }
    if (this.low) this.paintBand(pen, link);
    pen.strokeStyle = link;
    pen.lineWidth = 1.6;
    pen.beginPath();
    let drawing = false;
    this.y.forEach((y, i) => {
      if (y === null || this.isGap(i)) drawing = false;
      if (y === null) return;
      if (drawing) pen.lineTo(this.px(this.x[i]), this.py(y)); else pen.moveTo(this.px(this.x[i]), this.py(y));
      drawing = true;
    });
    pen.stroke();
    pen.restore();
  }

  // Whether nothing was measured between a point and the one before it: three times the usual step.
  isGap(i) {
    this.step ??= this.x.slice(1).map((x, k) => x - this.x[k]).sort((a, b) => a - b)[Math.floor((this.x.length - 1) / 2)] ?? 0;
    return i > 0 && this.x[i] - this.x[i - 1] > 3 * this.step;
  }

  paintBand(pen, ink) {
    pen.fillStyle = ink;
    pen.globalAlpha = 0.18;
    let from = 0;
    for (let i = 1; i <= this.x.length; i++) {
      if (i < this.x.length && this.low[i] !== null && this.low[i - 1] !== null && !this.isGap(i)) continue;
      pen.beginPath();
      for (let k = from; k < i; k++) if (this.high[k] !== null) pen.lineTo(this.px(this.x[k]), this.py(this.high[k]));
      for (let k = i - 1; k >= from; k--) if (this.low[k] !== null) pen.lineTo(this.px(this.x[k]), this.py(this.low[k]));
      pen.fill();
      from = i;
    }
    pen.globalAlpha = 1;
  }

  paint() {
    if (!this.base) return;
    const pen = this.canvas.getContext("2d");
    pen.setTransform(1, 0, 0, 1, 0, 0);
    pen.clearRect(0, 0, this.canvas.width, this.canvas.height);
    pen.drawImage(this.base, 0, 0);
    if (this.at === null) return;
    pen.scale(this.scale, this.scale);
    pen.strokeStyle = pen.fillStyle = colour("--bad");
    pen.lineWidth = 1.5;
    const x = this.px(this.at);
    pen.beginPath(); pen.moveTo(x, this.py(this.yRange[1])); pen.lineTo(x, this.py(this.yRange[0])); pen.stroke();
    const y = this.y[this.nearest(this.at)];
    if (y !== null && y !== undefined) { pen.beginPath(); pen.arc(x, this.py(y), 3.5, 0, 7); pen.fill(); }
  }

  // Index of the point that is nearest to a place, of a line whose x increases.
  nearest(at) {
    let [low, high] = [0, this.x.length - 1];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.x[middle] < at) low = middle + 1; else high = middle;
    }
    return low > 0 && at - this.x[low - 1] < this.x[low] - at ? low - 1 : low;
  }

  moveTo(at) {
    this.at = at;
    this.canvas.dataset.cursor = at.toFixed(3);
    this.paint();
  }
}

// Frames by number, fetched in batches, the next one ahead of time.
class Frames {
  constructor(address, at, count) {
    Object.assign(this, { address, at, count, batches: new Map(), size: 64 });
  }

  batch(number) {
    if (!this.batches.has(number)) {
      const query = this.at ? `?at=${encodeURIComponent(this.at)}` : "";
      this.batches.set(number, fetched(`${this.address}${number * this.size}${query}`, "arrayBuffer").then(Frames.pictures));
      if (this.batches.size > BATCHES) this.batches.delete(this.batches.keys().next().value);
    }
    return this.batches.get(number);
  }

  static pictures(buffer) {
    const view = new DataView(buffer);
    const found = [];
    for (let at = 0; at < buffer.byteLength;) {
      const length = view.getUint32(at);
      found.push(createImageBitmap(new Blob([buffer.slice(at + 4, at + 4 + length)], { type: "image/jpeg" })));
      at += 4 + length;
    }
    return Promise.all(found);
  }

  async picture(index) {
    const number = Math.floor(index / this.size);
    const pictures = await this.batch(number);
    if ((number + 1) * this.size < this.count) this.batch(number + 1).catch(() => {});
    return pictures[index % this.size];
  }
}

class Player {
  constructor(section, series) {
    this.section = section;
    this.wind = series.wind;
    this.reading = section.querySelector(".reading");
    const canvas = section.querySelector("canvas.plot");
    if (this.wind) {
      const frames = series.frames;
      this.plot = new Plot(canvas, {
        x: this.wind.time, y: this.wind.speed, low: this.wind.low, high: this.wind.high, fromZero: true,
        xLabel: frames ? "seconds from the first frame" : "seconds from the first mean",
        yLabel: `wind speed [m/s], band ${this.wind.band}`,
        shade: frames ? [0, frames.time[frames.time.length - 1]] : null,
      });
      canvas.addEventListener("pointermove", (event) => { if (!this.frames || event.buttons) this.point(event); });
      canvas.addEventListener("pointerdown", (event) => this.point(event));
    } else {
      canvas.remove();
    }
    if (series.frames && section.dataset.frames) this.begin(series.frames);
    else this.say(null);
  }

  begin({ count, index, time }) {
    Object.assign(this, { count, index, time, frame: -1, clock: 0, playing: false });
    this.frames = new Frames(this.section.dataset.frames, this.section.dataset.at, count);
    this.picture = this.section.querySelector("canvas.picture");
    const control = (name) => this.section.querySelector(`[data-control="${name}"]`);
    [this.play, this.slider, this.speed] = ["play", "frame", "speed"].map(control);
    this.slider.max = count - 1;
    this.play.addEventListener("click", () => this.toggle());
    this.slider.addEventListener("input", () => this.seek(this.timeOf(Number(this.slider.value))));
    this.seek(0);
  }

  // Time [s] of a frame, and the frame shown at a time: between the instants that were sent, evenly.
  timeOf(frame) { return Player.between(this.index, this.time, frame); }
  frameAt(time) { return Math.min(this.count - 1, Math.floor(Player.between(this.time, this.index, time) + 1e-6)); }

  static between(from, to, value) {
    let [low, high] = [0, from.length - 1];
    if (value <= from[0] || high === 0) return to[0];
    if (value >= from[high]) return to[high];
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (from[middle] <= value) low = middle; else high = middle;
    }
    return to[low] + (value - from[low]) / (from[high] - from[low]) * (to[high] - to[low]);
  }

  toggle() {
    this.playing = !this.playing;
    this.play.textContent = this.playing ? "Pause" : "Play";
    if (!this.playing) return;
    if (this.frame >= this.count - 1) this.clock = 0;
    this.before = performance.now();
    requestAnimationFrame((now) => this.step(now));
  }

  async step(now) {
    if (!this.playing) return;
    this.clock += Math.max(0, now - this.before) / 1000 * Number(this.speed.value);
    this.before = now;
    await this.show(this.clock);
    if (this.frame >= this.count - 1) { if (this.playing) this.toggle(); return; }
    requestAnimationFrame((later) => this.step(later));
  }

  seek(time) {
    this.clock = Math.min(Math.max(time, 0), this.time[this.time.length - 1]);
    return this.show(this.clock);
  }

  async show(time) {
    const frame = this.frameAt(time);
    if (frame === this.frame) return;
    this.frame = frame;
    try {
      const bitmap = await this.frames.picture(frame);
      if (frame !== this.frame) return; // another one was asked for meanwhile
      if (this.picture.width !== bitmap.width) this.picture.width = bitmap.width;
      if (this.picture.height !== bitmap.height) this.picture.height = bitmap.height;
      this.picture.getContext("2d").drawImage(bitmap, 0, 0);
    } catch (error) {
      this.playing = false;
      this.reading.textContent = `The film cannot be shown (${error.message}); reload the page.`;
      return;
    }
    this.slider.value = frame;
    this.picture.dataset.frame = frame;
    const at = this.timeOf(frame);
    if (this.plot) this.plot.moveTo(at);
    this.say(at);
  }

  point(event) {
    const at = this.plot.value(event.offsetX);
    if (this.frames) this.seek(at);
    else { this.plot.moveTo(Math.min(Math.max(at, this.plot.xRange[0]), this.plot.xRange[1])); this.say(this.plot.at); }
  }

  say(at) {
    const parts = [];
    if (at !== null) parts.push(`${at.toFixed(2)} s`);
    if (this.frames) parts.push(`frame ${this.frame + 1} of ${this.count}`);
    if (this.wind && at !== null) {
      const i = this.plot.nearest(at);
      const [speed, high, direction] = [this.wind.speed[i], this.wind.high[i], this.wind.direction[i]];
      if (speed !== null) parts.push(`wind ${speed.toFixed(2)}${this.wind.band === "±σ" ? ` ± ${(high - speed).toFixed(2)}` : ""} m/s`);
      if (direction !== null) parts.push(`from ${Math.round(direction * 180 / Math.PI)}°`);
    } else if (!this.wind) parts.push("no wind beside it");
    this.reading.textContent = parts.join(" · ") || "point at the wind to read it";
  }
}

const showEvidence = (section, { offset, score, evidence, chance_score: level }) => {
  const [whole, peak] = section.querySelectorAll("canvas");
  const chosen = Number(section.dataset.offset);
  const half = Math.max(10, 6 * Math.min(Number(section.dataset.sigma), 5));
  const xLabel = "offset added to the camera's clock [s]";
  const plots = [
    new Plot(whole, { x: offset, y: evidence, level, xLabel, yLabel: "evidence z" }),
    new Plot(peak, { x: offset, y: score, xLabel, yLabel: "score z", range: [chosen - half, chosen + half] }),
  ];
  for (const plot of plots) plot.moveTo(chosen);
};

const failed = (section) => (error) => {
  const line = document.createElement("p");
  line.className = "verdict missed";
  line.textContent = `This part cannot be shown (${error.message}); flagdata doctor and verify say what is wrong.`;
  section.replaceChildren(line);
};

for (const section of document.querySelectorAll("[data-series]")) {
  fetched(section.dataset.series, "json").then((series) => new Player(section, series)).catch(failed(section));
}
for (const section of document.querySelectorAll("[data-evidence]")) {
  fetched(section.dataset.evidence, "json").then((found) => showEvidence(section, found)).catch(failed(section));
}
for (const picture of document.querySelectorAll(".card img")) {
  const without = () => picture.replaceWith(Object.assign(document.createElement("span"), { className: "none", textContent: "no picture" }));
  if (picture.complete && !picture.naturalWidth) without(); else picture.addEventListener("error", without);
}
