// The report's viewer: which pictures, which mode, which exposure, which part; keys, mouse and the address.
"use strict";

// Reads `key` and shows `name`. `pair`: needs B. `map`: a map of A against the reference.
const MODES = [
  { id: "a", name: "A", key: "a" },
  { id: "b", name: "B", key: "b" },
  { id: "slider", name: "Slider", key: "s" },
  { id: "difference", name: "|A − B|", key: "d" },
  { id: "signed", name: "A − B", key: "g" },
  { id: "flip", name: "FLIP", key: "f" },
  { id: "error", name: "Relative error", key: "e" },
  { id: "steps", name: "Steps", key: "t" },
];
const NUMBERS_FROM = 52; // CSS pixels a pixel must have for its three numbers to be legible in it.
const LARGEST_ZOOM = 160;

class Viewer {
  constructor(data) {
    this.data = data;
    this.canvas = element("canvas");
    this.context = this.canvas.getContext("2d");
    this.exact = data.pictures.map((picture, index) => index).filter((index) => data.pictures[index].exact);
    this.reference = this.exact.includes(0) ? 0 : -1;
    this.state = { a: this.exact[Math.min(1, this.exact.length - 1)], b: this.exact[0], mode: "a", stops: 0, gain: 1, split: 0.5 };
    const last = this.exact[this.exact.length - 1];
    if (this.exact.length > 2) Object.assign(this.state, { a: last, b: this.exact[0] });
    this.view = { zoom: 1, x: 0, y: 0, fitted: true };
    this.layers = [newLayer(data), newLayer(data)];
    this.pointer = null;
    this.buildControls();
    this.listen();
  }

  get ev() {
    return this.data.ev - this.state.stops;
  }

  // ---- What is shown

  // Repaints the pictures where pictures, mode or exposure changed, then draws.
  update() {
    return (this.updating = this.updateNow());
  }

  async updateNow() {
    const ticket = (this.ticket = {});
    try {
      const [a, b, reference] = await Promise.all(
        [this.state.a, this.state.b, this.reference].map((index) => (index < 0 ? null : this.data.load(index))));
      if (ticket !== this.ticket) return; // A later change overtook this one.
      Object.assign(this, { valuesA: a, valuesB: b, valuesReference: reference });
      this.paint();
      this.message("");
    } catch (error) {
      this.message(error.message);
    }
    this.showControls();
    this.draw();
    this.readOut();
    this.writeAddress();
  }

  // Done when no change is under way.
  async settled() {
    for (let last = null; last !== this.updating; ) await (last = this.updating);
  }

  paint() {
    const { data, valuesA: a, valuesB: b, valuesReference: reference } = this;
    const [first, second] = this.layers;
    const { mode, gain } = this.state;
    const rgba = first.image.data;
    if (mode === "a" || mode === "slider") data.paintColors(rgba, a, this.ev);
    else if (mode === "b") data.paintColors(rgba, b, this.ev);
    else if (mode === "difference") data.paintDifference(rgba, a, b, this.ev, gain);
    else if (mode === "signed") data.paintSigned(rgba, a, b, this.ev, gain);
    else if (mode === "flip") data.paintHeat(rgba, data.magma, (i) => a.flip[i]);
    else if (mode === "steps") data.paintHeat(rgba, data.viridis, (i) => a.steps[i] / data.steps_high);
    else data.paintHeat(rgba, data.magma, (i) => data.errorPosition(relativeError(a, reference, i)));
    first.context.putImageData(first.image, 0, 0);
    if (mode === "slider") {
      data.paintColors(second.image.data, b, this.ev);
      second.context.putImageData(second.image, 0, 0);
    }
  }

  // Whether A has what a mode shows.
  available(mode) {
    const picture = this.data.pictures[this.state.a];
    if (mode === "flip" || mode === "steps") return picture[mode];
    if (mode === "error") return this.reference >= 0 && this.state.a !== this.reference;
    return true;
  }

  // As high as the picture is at the largest whole zoom that fits the column and most of the window.
  layOut() {
    const ratio = window.devicePixelRatio || 1;
    const room = { width: this.canvas.clientWidth, height: Math.min(0.8 * window.innerHeight, 760) };
    let zoom = Math.min(room.width / this.data.width, room.height / this.data.height);
    // Whole screen pixels a pixel, so that all are equally large.
    if (zoom * ratio >= 1) zoom = Math.floor(zoom * ratio) / ratio;
    this.fittedZoom = zoom;
    this.canvas.style.height = `${Math.max(240, Math.round(zoom * this.data.height))}px`;
    this.draw();
  }

  draw() {
    const { canvas, context, view, data } = this;
    const ratio = window.devicePixelRatio || 1;
    const box = canvas.getBoundingClientRect();
    const width = Math.max(1, Math.round(box.width * ratio));
    const height = Math.max(1, Math.round(box.height * ratio));
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    if (view.fitted) this.fit(box);
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.clearRect(0, 0, width, height);
    context.setTransform(ratio * view.zoom, 0, 0, ratio * view.zoom, Math.round(ratio * view.x), Math.round(ratio * view.y));
    context.imageSmoothingEnabled = ratio * view.zoom < 1;
    context.drawImage(this.layers[0].canvas, 0, 0);
    if (this.state.mode === "slider") this.drawSplit(box, ratio);
    if (view.zoom >= NUMBERS_FROM) this.drawNumbers(box, ratio);
    const center = this.pixelAt(box.width / 2, box.height / 2);
    canvas.setAttribute("aria-description", `${data.width} x ${data.height} pixels, zoom ${view.zoom.toFixed(2)}, centre ${center.x}, ${center.y}`);
  }

  drawSplit(box, ratio) {
    const { context, view, data } = this;
    const split = this.state.split * box.width;
    context.save();
    const from = (split - view.x) / view.zoom;
    context.beginPath();
    context.rect(from, 0, Math.max(0, data.width - from), data.height);
    context.clip();
    context.drawImage(this.layers[1].canvas, 0, 0);
    context.restore();
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.fillStyle = "#fff";
    context.strokeStyle = "rgba(0,0,0,.55)";
    context.lineWidth = 1;
    context.fillRect(split - 1, 0, 2, box.height);
    context.beginPath();
    context.arc(split, box.height / 2, 9, 0, 2 * Math.PI);
    context.fill();
    context.stroke();
  }

  drawNumbers(box, ratio) {
    const { context, view, data } = this;
    const shown = (i, x) => {
      const right = this.state.mode === "slider" && view.x + (x + 0.5) * view.zoom > this.state.split * box.width;
      if (this.state.mode === "b" || right) return this.lines(this.valuesB, i);
      if (this.state.mode === "difference" || this.state.mode === "signed")
        return [0, 1, 2].map((c) => compact(this.valuesA.radiance[c][i] - this.valuesB.radiance[c][i]));
      if (this.state.mode === "flip") return [compact(this.valuesA.flip[i])];
      if (this.state.mode === "steps") return [compact(this.valuesA.steps[i])];
      if (this.state.mode === "error") return [compact(relativeError(this.valuesA, this.valuesReference, i))];
      return this.lines(this.valuesA, i);
    };
    const begin = this.pixelAt(0, 0);
    const end = this.pixelAt(box.width, box.height);
    const size = Math.min(13, view.zoom / 5.5);
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.font = `${size}px ui-monospace, "DejaVu Sans Mono", Menlo, Consolas, monospace`;
    context.textAlign = "center";
    context.textBaseline = "middle";
    for (let y = Math.max(0, begin.y); y <= Math.min(data.height - 1, end.y); ++y) {
      for (let x = Math.max(0, begin.x); x <= Math.min(data.width - 1, end.x); ++x) {
        const i = y * data.width + x;
        const texts = shown(i, x);
        const right = this.state.mode === "slider" && view.x + (x + 0.5) * view.zoom > this.state.split * box.width;
        const rgba = this.layers[right ? 1 : 0].image.data;
        const bright = 0.2126 * rgba[4 * i] + 0.7152 * rgba[4 * i + 1] + 0.0722 * rgba[4 * i + 2];
        context.fillStyle = bright > 115 ? "#000" : "#fff";
        const middle = view.y + (y + 0.5) * view.zoom;
        texts.forEach((text, line) =>
          context.fillText(text, view.x + (x + 0.5) * view.zoom, middle + (line - (texts.length - 1) / 2) * 1.3 * size));
      }
    }
  }

  lines(values, i) {
    return values.radiance.map((plane) => compact(plane[i]));
  }

  // ---- Zoom and place. view.x, view.y: where the picture's corner lies, in CSS pixels of the canvas.

  fit(box) {
    const zoom = this.fittedZoom;
    this.view = { zoom, x: (box.width - zoom * this.data.width) / 2, y: (box.height - zoom * this.data.height) / 2, fitted: true };
  }

  pixelAt(x, y) {
    return { x: Math.floor((x - this.view.x) / this.view.zoom), y: Math.floor((y - this.view.y) / this.view.zoom) };
  }

  zoomAbout(x, y, factor) {
    const zoom = Math.min(LARGEST_ZOOM, Math.max(0.05, this.view.zoom * factor));
    const scale = zoom / this.view.zoom;
    this.place(zoom, x + (this.view.x - x) * scale, y + (this.view.y - y) * scale);
  }

  // Keeps at least a part of the picture in sight.
  place(zoom, x, y) {
    const box = this.canvas.getBoundingClientRect();
    const margin = 40;
    const within = (value, extent, room) => Math.min(room - margin, Math.max(margin - extent, value));
    this.view = {
      zoom,
      x: within(x, zoom * this.data.width, box.width),
      y: within(y, zoom * this.data.height, box.height),
      fitted: false,
    };
    this.draw();
    this.readOut();
  }

  zoomAboutCenter(factor) {
    const box = this.canvas.getBoundingClientRect();
    this.zoomAbout(box.width / 2, box.height / 2, factor);
  }

  // ---- Numbers under the pointer

  readOut() {
    const rows = [["A", this.state.a, this.valuesA], ["B", this.state.b, this.valuesB]];
    if (this.reference >= 0) rows.push(["", this.reference, this.valuesReference]);
    const pixel = this.pointer && this.pixelAt(this.pointer.x, this.pointer.y);
    const inside = pixel && pixel.x >= 0 && pixel.y >= 0 && pixel.x < this.data.width && pixel.y < this.data.height;
    element("readout-place").textContent = inside ? `pixel ${pixel.x}, ${pixel.y}` : "pixel";
    const body = element("readout").tBodies[0];
    while (body.rows.length < rows.length) for (let i = 0, row = body.insertRow(); i < 8; ++i) row.insertCell();
    rows.forEach(([letter, index, values], row) => {
      const cells = body.rows[row].cells;
      cells[0].textContent = `${letter} ${this.data.pictures[index].name}`.trim();
      cells[0].className = "text";
      const texts = inside && values ? this.readings(values, index, pixel.y * this.data.width + pixel.x) : Array(7).fill("–");
      texts.forEach((text, i) => (cells[i + 1].textContent = text));
    });
  }

  readings(values, index, i) {
    const isReference = index === this.reference;
    return [
      ...values.radiance.map((plane) => shortestFloat(plane[i])),
      compact(luminance(values.radiance, i), 5),
      isReference || !this.valuesReference ? "–" : compact(relativeError(values, this.valuesReference, i)),
      values.flip ? compact(values.flip[i]) : "–",
      values.steps ? compact(values.steps[i]) : "–",
    ];
  }

  // ---- Controls

  buildControls() {
    for (const id of ["pick-a", "pick-b"]) {
      this.data.pictures.forEach((picture, index) => {
        const option = new Option(picture.exact ? picture.name : `${picture.name} (thumbnail only)`, index);
        option.disabled = !picture.exact;
        element(id).add(option);
      });
      element(id).addEventListener("change", (event) => this.set({ [id.slice(-1)]: Number(event.target.value) }));
    }
    for (const mode of MODES) {
      const button = document.createElement("button");
      Object.assign(button, { type: "button", textContent: mode.name, title: `${mode.name} (${mode.key.toUpperCase()})` });
      button.dataset.mode = mode.id;
      button.addEventListener("click", () => this.set({ mode: mode.id }));
      element("modes").append(button);
    }
    element("exposure").addEventListener("input", (event) => this.set({ stops: Number(event.target.value) }));
    element("gain").addEventListener("change", (event) => this.set({ gain: Number(event.target.value) }));
    element("help-button").addEventListener("click", () => this.help(element("help").hidden));
  }

  showControls() {
    const { state, data } = this;
    element("pick-a").value = state.a;
    element("pick-b").value = state.b;
    for (const button of element("modes").children) {
      button.setAttribute("aria-pressed", button.dataset.mode === state.mode);
      button.disabled = !this.available(button.dataset.mode);
    }
    element("exposure").value = state.stops;
    const sign = state.stops < 0 ? "−" : "+";
    element("exposure-value").textContent = `${sign}${Math.abs(state.stops).toFixed(2)} stops, EV ${this.ev.toFixed(2).replace("-", "−")}`;
    const differs = state.mode === "difference" || state.mode === "signed";
    element("gain-label").hidden = !differs;
    element("gain").value = state.gain;
    const name = (index) => data.pictures[index].name;
    element("tag-a").textContent = state.mode === "b" ? "" : differs ? `${name(state.a)} − ${name(state.b)}` : name(state.a);
    element("tag-b").textContent = state.mode === "b" || state.mode === "slider" ? name(state.b) : "";
    this.showLegend();
  }

  showLegend() {
    const { data } = this;
    const legends = {
      flip: ["FLIP of A against the reference", "0", "1", "magma"],
      error: ["relative error of A, logarithmic", `${compact(100 * data.error_low)} %`, `${compact(100 * data.error_high)} %`, "magma"],
      steps: ["tracer steps a camera ray of A", "0", compact(data.steps_high), "viridis"],
      signed: ["luminance, A − B", "A darker", "A brighter", "signed"],
    };
    const legend = legends[this.state.mode];
    element("legend").hidden = !legend;
    if (!legend) return;
    ["name", "low", "high"].forEach((part, i) => (element(`legend-${part}`).textContent = legend[i]));
    element("legend-bar").className = legend[3];
  }

  help(shown) {
    element("help").hidden = !shown;
    element("help-button").setAttribute("aria-expanded", shown);
  }

  message(text) {
    element("message").textContent = text;
    element("message").hidden = !text;
  }

  // ---- State, and its form in the address: #a=NAME&b=NAME&mode=MODE&stops=STOPS&gain=GAIN

  set(change) {
    Object.assign(this.state, change);
    if (!this.available(this.state.mode)) this.state.mode = "a";
    return this.update();
  }

  writeAddress() {
    if (!this.changed) return; // Nothing was asked for: the address stays as it was opened.
    const { state, data } = this;
    const parts = [["a", data.pictures[state.a].name], ["b", data.pictures[state.b].name], ["mode", state.mode]];
    if (state.stops !== 0) parts.push(["stops", state.stops]);
    if (state.gain !== 1) parts.push(["gain", state.gain]);
    history.replaceState(null, "", "#" + parts.map(([key, value]) => `${key}=${encodeURIComponent(value)}`).join("&"));
  }

  // What the address asks for; names that are not here are ignored.
  readAddress() {
    if (!location.hash.includes("=")) return false;
    const asked = new URLSearchParams(location.hash.slice(1).replaceAll("+", "%2B"));
    const change = {};
    for (const key of ["a", "b"]) {
      const index = this.data.indexOf(asked.get(key));
      if (this.exact.includes(index)) change[key] = index;
    }
    if (MODES.some((mode) => mode.id === asked.get("mode"))) change.mode = asked.get("mode");
    const stops = Number.parseFloat(asked.get("stops"));
    if (Math.abs(stops) <= 8) change.stops = stops;
    if (["1", "4", "16", "64"].includes(asked.get("gain"))) change.gain = Number(asked.get("gain"));
    Object.assign(this.state, change);
    if (!this.available(this.state.mode)) this.state.mode = "a";
    return true;
  }

  // ---- Keys and mouse

  listen() {
    const viewer = element("viewer");
    viewer.addEventListener("keydown", (event) => this.onKey(event));
    for (const type of ["input", "change", "click", "keydown"]) viewer.addEventListener(type, () => (this.changed = true), true);
    const canvas = this.canvas;
    canvas.addEventListener("wheel", (event) => this.onWheel(event), { passive: false });
    canvas.addEventListener("pointerdown", (event) => this.onDown(event));
    canvas.addEventListener("pointermove", (event) => this.onMove(event));
    canvas.addEventListener("pointerup", () => (this.drag = null));
    canvas.addEventListener("pointercancel", () => (this.drag = null));
    new ResizeObserver(() => this.layOut()).observe(canvas);
    window.addEventListener("resize", () => this.layOut());
    window.addEventListener("hashchange", () => {
      if (!this.readAddress()) return;
      this.update();
      viewer.scrollIntoView({ block: "nearest" });
    });
  }

  onKey(event) {
    const typing = event.target.matches("select, input");
    if (event.ctrlKey || event.metaKey || event.altKey || typing) return;
    if (event.key === " " && event.target.matches("button")) return;
    const action = this.actionOf(event.key);
    if (!action) return;
    event.preventDefault();
    action();
  }

  actionOf(key) {
    const mode = MODES.find((candidate) => candidate.key === key.toLowerCase());
    if (mode) return () => this.available(mode.id) && this.set({ mode: mode.id });
    const step = 48;
    const { view, state } = this;
    const actions = {
      " ": () => this.set({ mode: state.mode === "a" ? "b" : "a" }),
      "[": () => this.set({ a: this.neighbour(state.a, -1) }),
      "]": () => this.set({ a: this.neighbour(state.a, 1) }),
      "{": () => this.set({ b: this.neighbour(state.b, -1) }),
      "}": () => this.set({ b: this.neighbour(state.b, 1) }),
      "+": () => this.set({ stops: Math.min(8, state.stops + 0.5) }),
      "-": () => this.set({ stops: Math.max(-8, state.stops - 0.5) }),
      "=": () => this.set({ stops: Math.min(8, state.stops + 0.5) }), // The same key as +, without shift.
      r: () => this.set({ stops: 0 }),
      z: () => this.zoomAboutCenter(Math.SQRT2),
      x: () => this.zoomAboutCenter(Math.SQRT1_2),
      0: () => ((view.fitted = true), this.draw(), this.readOut()),
      1: () => this.zoomAboutCenter(1 / ((window.devicePixelRatio || 1) * view.zoom)),
      ArrowLeft: () => this.place(view.zoom, view.x + step, view.y),
      ArrowRight: () => this.place(view.zoom, view.x - step, view.y),
      ArrowUp: () => this.place(view.zoom, view.x, view.y + step),
      ArrowDown: () => this.place(view.zoom, view.x, view.y - step),
      "?": () => this.help(element("help").hidden),
      Escape: () => this.help(false),
    };
    return actions[key.length === 1 ? key.toLowerCase() : key];
  }

  neighbour(index, step) {
    const at = this.exact.indexOf(index);
    return this.exact[(at + step + this.exact.length) % this.exact.length];
  }

  onWheel(event) {
    // Until the picture is clicked the wheel moves the page.
    if (document.activeElement !== this.canvas && !event.ctrlKey) return;
    event.preventDefault();
    const lines = event.deltaMode === WheelEvent.DOM_DELTA_LINE ? 16 : 1;
    this.zoomAbout(event.offsetX, event.offsetY, 2 ** (-event.deltaY * lines / 240));
  }

  onDown(event) {
    this.canvas.setPointerCapture(event.pointerId);
    const split = this.state.split * this.canvas.getBoundingClientRect().width;
    const moves = this.state.mode === "slider" && Math.abs(event.offsetX - split) < 16;
    this.drag = { split: moves, x: event.offsetX - this.view.x, y: event.offsetY - this.view.y };
  }

  onMove(event) {
    this.pointer = { x: event.offsetX, y: event.offsetY };
    if (this.drag && this.drag.split) {
      this.state.split = Math.min(1, Math.max(0, event.offsetX / this.canvas.getBoundingClientRect().width));
      this.draw();
    } else if (this.drag) {
      this.place(this.view.zoom, event.offsetX - this.drag.x, event.offsetY - this.drag.y);
    }
    this.readOut();
  }
}

function element(id) {
  return document.getElementById(id);
}

function newLayer(data) {
  const canvas = Object.assign(document.createElement("canvas"), { width: data.width, height: data.height });
  return { canvas, context: canvas.getContext("2d"), image: new ImageData(data.width, data.height) };
}

// A few significant digits, short enough for a table or a pixel.
function compact(value, digits = 4) {
  if (!Number.isFinite(value)) return String(value);
  const size = Math.abs(value);
  if (size !== 0 && (size >= 1e6 || size < 1e-4)) return value.toExponential(digits - 2);
  return String(Number(value.toPrecision(digits)));
}

function startViewer() {
  const data = ReportData.fromPage();
  if (!data.pictures.some((picture) => picture.exact)) return null;
  const viewer = new Viewer(data);
  element("viewer").hidden = false;
  viewer.layOut();
  const asked = viewer.readAddress();
  const ready = viewer.update();
  if (asked) element("viewer").scrollIntoView({ block: "nearest" });
  return { viewer, ready };
}

// Buttons beside the commands: they need a script, so that a script makes them.
function addCopyButtons() {
  if (!navigator.clipboard) return;
  for (const command of document.querySelectorAll(".command")) {
    const button = Object.assign(document.createElement("button"), { type: "button", className: "copy", textContent: "Copy" });
    button.addEventListener("click", async () => {
      await navigator.clipboard.writeText(command.querySelector("code").textContent);
      button.textContent = "Copied";
      setTimeout(() => (button.textContent = "Copy"), 1200);
    });
    command.append(button);
  }
}

addCopyButtons();
if (document.getElementById("viewer-data")) {
  const started = startViewer();
  // For scripts and tests: exact values and what the canvas is given, by picture name and pixel.
  if (started) {
    const { viewer, ready } = started;
    window.fieldlight = {
      ready,
      viewer,
      pictures: viewer.data.pictures.map((picture) => picture.name),
      async pixel(name, x, y) {
        const values = await viewer.data.load(viewer.data.indexOf(name));
        return values.radiance.map((plane) => plane[y * viewer.data.width + x]);
      },
    };
  }
}
