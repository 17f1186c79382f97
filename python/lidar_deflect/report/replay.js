"use strict";
(() => {
  const floats = (text) => {
    const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
    return new Float32Array(bytes.buffer);
  };
  const nearest = (times, t) => {
    let low = 0, high = times.length - 1;
    while (high - low > 1) { const mid = (low + high) >> 1; if (times[mid] <= t) low = mid; else high = mid; }
    return Math.abs(times[high] - t) < Math.abs(times[low] - t) ? high : low;
  };
  const VIEWS = { iso: [-2.25, 0.35], top: [-Math.PI / 2, Math.PI / 2 - 0.001], side: [-Math.PI / 2, 0], end: [-Math.PI, 0] };
  const VERTEX = `attribute vec3 at; attribute float shade; uniform mat4 camera; uniform float size;
    uniform vec3 palette[9]; varying vec3 colour;
    void main() { gl_Position = camera * vec4(at, 1.0); gl_PointSize = size;
      int k = int(shade + 0.5); colour = palette[8];
      for (int i = 0; i < 8; i++) if (i == k) colour = palette[i]; }`;
  const FRAGMENT = `precision mediump float; varying vec3 colour;
    void main() { vec2 off = gl_PointCoord - 0.5; if (dot(off, off) > 0.25) discard; gl_FragColor = vec4(colour, 0.85); }`;
  // From too near over right to too far: blue, grey, red; told apart by the colour-blind.
  const RESIDUAL = ["#2166ac", "#4393c3", "#92c5de", "#bbbbbb", "#bbbbbb", "#f4a582", "#d6604d", "#b2182b", "#888888"];
  const rgb = (hex) => [1, 3, 5].map((k) => parseInt(hex.slice(k, k + 2), 16) / 255);

  class Replay {
    constructor(figure) {
      this.figure = figure;
      this.stage = figure.querySelector(".stage");
      const source = figure.querySelector("script");
      this.said = source.dataset;
      const data = this.data = JSON.parse(source.textContent);
      this.time = floats(data.time);
      this.marks = floats(data.marks);
      this.rest = floats(data.rest);
      this.lines = data.lines && { time: floats(data.lines.time), points: floats(data.lines.points), count: data.lines.count };
      this.clouds = data.clouds && { ...data.clouds, time: floats(data.clouds.time), points: floats(data.clouds.points),
        lidar: floats(data.clouds.lidar), residual: data.clouds.residual && floats(data.clouds.residual) };
      this.frame = this.data.first;
      this.zoom = 1; this.pan = [0, 0];
      [this.turn, this.tilt] = VIEWS.iso;
      this.fit();
      this.ink = figure.querySelector(".ink").getContext("2d");
      this.openCloud(figure.querySelector(".cloud"));
      this.controls();
      this.resize();
    }

    // Middle and size of everything that is shown.
    fit() {
      const low = [1e9, 1e9, 1e9], high = [-1e9, -1e9, -1e9];
      const take = (values) => { for (let i = 0; i < values.length; i++) if (values[i] === values[i]) {
        low[i % 3] = Math.min(low[i % 3], values[i]); high[i % 3] = Math.max(high[i % 3], values[i]); } };
      take(this.marks); take(this.rest);
      if (this.lines) take(this.lines.points);
      if (this.clouds) take(this.clouds.points);
      this.data.lidars.forEach((lidar) => take(lidar.at));
      this.middle = low.map((value, k) => (value + high[k]) / 2);
      this.size = Math.max(1, Math.hypot(...low.map((value, k) => high[k] - value)));
      this.low = low; this.high = high;
    }

    openCloud(canvas) {
      this.canvas = canvas;
      const gl = canvas.getContext("webgl", { antialias: true, preserveDrawingBuffer: true, alpha: true });
      if (!gl || !this.clouds) return;
      const shader = (kind, text) => { const made = gl.createShader(kind); gl.shaderSource(made, text); gl.compileShader(made); return made; };
      const program = gl.createProgram();
      gl.attachShader(program, shader(gl.VERTEX_SHADER, VERTEX));
      gl.attachShader(program, shader(gl.FRAGMENT_SHADER, FRAGMENT));
      gl.linkProgram(program);
      if (!gl.getProgramParameter(program, gl.LINK_STATUS)) return;
      gl.useProgram(program);
      const buffer = (values, name, size) => {
        gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
        gl.bufferData(gl.ARRAY_BUFFER, values, gl.STATIC_DRAW);
        const place = gl.getAttribLocation(program, name);
        gl.enableVertexAttribArray(place);
        gl.vertexAttribPointer(place, size, gl.FLOAT, false, 0, 0);
      };
      const centred = this.clouds.points.map((value, i) => value - this.middle[i % 3]);
      buffer(centred, "at", 3);
      this.upload = () => buffer(this.shades(), "shade", 1);
      this.upload();
      this.gl = gl;
      this.place = (name) => gl.getUniformLocation(program, name);
    }

    shades() {
      const cloud = this.clouds;
      if (this.colour !== "residual" || !cloud.residual) return cloud.lidar.map((k) => k % 8);
      return cloud.residual.map((mm) => (mm === mm ? Math.max(0, Math.min(7, Math.floor(4 + mm / 5))) : 8));
    }

    palette() {
      const names = this.colour === "residual" && this.clouds.residual ? RESIDUAL : [...this.data.colours.slice(0, 8), "#888888"];
      return new Float32Array(names.flatMap(rgb));
    }

    controls() {
      const find = (name) => this.figure.querySelector(name);
      this.slider = find(".time"); this.button = find(".play"); this.now = find(".now");
      this.slider.max = String(this.time.length - 1);
      this.slider.addEventListener("input", () => { this.stop(); this.show(Number(this.slider.value)); });
      this.button.addEventListener("click", () => (this.playing ? this.stop() : this.play()));
      find(".colour").addEventListener("change", (event) => { this.colour = event.target.value; if (this.gl) this.upload(); this.draw(); });
      find(".colour").closest("label").hidden = !(this.clouds && this.clouds.residual);
      this.figure.querySelectorAll("[data-view]").forEach((button) => button.addEventListener("click", () => {
        [this.turn, this.tilt] = VIEWS[button.dataset.view]; this.zoom = 1; this.pan = [0, 0]; this.draw(); }));
      const stage = this.stage;
      stage.addEventListener("pointerdown", (event) => { this.held = [event.clientX, event.clientY]; stage.setPointerCapture(event.pointerId); });
      stage.addEventListener("pointerup", () => { this.held = null; });
      stage.addEventListener("pointermove", (event) => {
        if (!this.held) return;
        const off = [event.clientX - this.held[0], event.clientY - this.held[1]];
        this.held = [event.clientX, event.clientY];
        if (event.shiftKey) this.pan = [this.pan[0] + off[0], this.pan[1] + off[1]];
        else this.orbit(off[0] * 0.006, off[1] * 0.006);
        this.draw();
      });
      stage.addEventListener("wheel", (event) => { event.preventDefault(); this.zoom *= Math.exp(-event.deltaY * 0.0012); this.draw(); }, { passive: false });
      stage.addEventListener("keydown", (event) => {
        const turn = { ArrowLeft: [-0.08, 0], ArrowRight: [0.08, 0], ArrowUp: [0, 0.08], ArrowDown: [0, -0.08] }[event.key];
        if (turn) this.orbit(...turn);
        else if (event.key === "+") this.zoom *= 1.15;
        else if (event.key === "-") this.zoom /= 1.15;
        else if (event.key === " ") { if (this.playing) this.stop(); else this.play(); }
        else return;
        event.preventDefault(); this.draw();
      });
      new ResizeObserver(() => this.resize()).observe(stage);
      window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.draw());
      window.addEventListener("beforeprint", () => this.onPaper(true, { width: "690px", height: "330px" }));
      window.addEventListener("afterprint", () => this.onPaper(false, { width: "", height: "" }));
    }

    // On paper the largest deflection is shown.
    onPaper(paper, box) {
      this.paper = paper;
      Object.assign(this.stage.style, box);
      if (paper) { this.seen = this.frame; this.frame = this.data.largest; } else this.frame = this.seen;
      this.resize();
    }

    orbit(turn, tilt) {
      this.turn += turn;
      this.tilt = Math.max(-1.57, Math.min(1.57, this.tilt + tilt));
    }

    play() {
      this.playing = true;
      this.button.textContent = this.button.dataset.pause;
      if (this.frame >= this.time.length - 1) this.frame = 0;
      let clock = this.time[this.frame], before = null;
      const tick = (stamp) => {
        if (!this.playing) return;
        if (before !== null) clock += ((stamp - before) / 1000) * Number(this.figure.querySelector(".speed").value);
        before = stamp;
        let next = this.frame;
        while (next < this.time.length - 1 && this.time[next + 1] <= clock) next += 1;
        this.show(next);
        if (next >= this.time.length - 1) this.stop(); else requestAnimationFrame(tick);
      };
      requestAnimationFrame(tick);
    }

    stop() { this.playing = false; this.button.textContent = this.button.dataset.play; }

    show(frame) { this.frame = frame; this.slider.value = String(frame); this.draw(); }

    resize() {
      const box = this.stage.getBoundingClientRect(), ratio = Math.min(window.devicePixelRatio || 1, 2);
      this.width = Math.max(1, box.width); this.height = Math.max(1, box.height); this.ratio = ratio;
      for (const canvas of [this.canvas, this.ink.canvas]) { canvas.width = this.width * ratio; canvas.height = this.height * ratio; }
      this.draw();
    }

    // Orthographic: equal lengths stay equal. Rows of right, up and depth in world axes.
    axes() {
      const [ct, st, cp, sp] = [Math.cos(this.turn), Math.sin(this.turn), Math.cos(this.tilt), Math.sin(this.tilt)];
      const depth = [ct * cp, sp, st * cp];
      const right = [st, 0, -ct];
      const up = [-ct * sp, cp, -st * sp];
      return { right, up, depth };
    }

    scale() { return (0.94 * this.zoom * Math.min(this.width, this.height * 2.3)) / this.extent(); }

    extent() {
      const { right, up } = this.axes();
      const span = (axis) => axis.reduce((sum, part, k) => sum + Math.abs(part) * (this.high[k] - this.low[k]), 0);
      return Math.max(4, span(right), span(up) * Math.min(this.width, this.height * 2.3) / this.height * 1.15);
    }

    project(x, y, z) {
      const p = [x - this.middle[0], y - this.middle[1], z - this.middle[2]];
      const dot = (axis) => axis[0] * p[0] + axis[1] * p[1] + axis[2] * p[2];
      return [this.width / 2 + this.pan[0] + dot(this.now3.right) * this.k, this.height / 2 + this.pan[1] - dot(this.now3.up) * this.k];
    }

    draw() {
      this.now3 = this.axes(); this.k = this.scale();
      const t = this.time[this.frame];
      this.drawCloud(t);
      const ink = this.ink, style = getComputedStyle(document.documentElement);
      ink.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
      ink.clearRect(0, 0, this.width, this.height);
      const text = this.paper ? "#000" : style.getPropertyValue("--text").trim();
      const quiet = this.paper ? "#444" : style.getPropertyValue("--quiet").trim();
      const accent = this.data.colours[0];
      ink.font = "12px system-ui, sans-serif"; ink.textBaseline = "middle"; ink.lineJoin = "round";
      this.floor(quiet);
      this.path(this.restLine(), quiet, 1, [4, 4]);
      this.path(this.blade(t), accent, 3.5);
      this.wires(t, quiet);
      this.data.lidars.forEach((lidar, k) => this.mark(lidar.at, lidar.name, this.data.colours[k % 8], "square", text));
      this.sections(text);
      this.compass(text);
      this.say(t);
    }

    drawCloud(t) {
      const cloud = this.clouds, gl = this.gl;
      if (!cloud) return;
      const k = nearest(cloud.time, t), first = cloud.first[k], count = cloud.first[k + 1] - first;
      if (!gl) return this.inkCloud(first, count);
      gl.viewport(0, 0, this.canvas.width, this.canvas.height);
      gl.clearColor(0, 0, 0, 0); gl.clear(gl.COLOR_BUFFER_BIT);
      const { right, up, depth } = this.now3;
      const sx = (2 * this.k) / this.width, sy = (2 * this.k) / this.height, sz = 1 / (2 * this.size);
      const columns = [0, 1, 2].flatMap((i) => [right[i] * sx, up[i] * sy, -depth[i] * sz, 0]);
      const camera = new Float32Array([...columns, (2 * this.pan[0]) / this.width, (-2 * this.pan[1]) / this.height, 0, 1]);
      gl.uniformMatrix4fv(this.place("camera"), false, camera);
      gl.uniform1f(this.place("size"), 2.6 * this.ratio);
      gl.uniform3fv(this.place("palette"), this.palette());
      gl.drawArrays(gl.POINTS, first, count);
    }

    // Without WebGL the echoes are drawn one by one.
    inkCloud(first, count) {
      const shades = this.shades(), names = this.colour === "residual" ? RESIDUAL : this.data.colours;
      this.later = () => { for (let i = first; i < first + count; i++) {
        const [x, y] = this.project(...this.clouds.points.subarray(3 * i, 3 * i + 3));
        this.ink.fillStyle = names[shades[i]] || "#888"; this.ink.fillRect(x - 1, y - 1, 2, 2); } };
    }

    floor(colour) {
      if (this.later) { this.later(); this.later = null; }
      const ink = this.ink, y = this.low[1], step = this.size > 60 ? 10 : 5;
      const from = [0, 2].map((k) => Math.floor(this.low[k] / step) * step);
      const to = [0, 2].map((k) => Math.ceil(this.high[k] / step) * step);
      ink.globalAlpha = 0.25;
      for (let x = from[0]; x <= to[0]; x += step) this.path([[x, y, from[1]], [x, y, to[1]]], colour, 1);
      for (let z = from[1]; z <= to[1]; z += step) this.path([[from[0], y, z], [to[0], y, z]], colour, 1);
      ink.globalAlpha = 0.8; ink.fillStyle = colour; ink.textAlign = "center";
      for (let z = from[1]; z <= to[1]; z += step) this.write(`${z} m`, [from[0], y, z], 0, 10);
      ink.globalAlpha = 1;
    }

    path(points, colour, width, dash = []) {
      const ink = this.ink;
      ink.strokeStyle = colour; ink.lineWidth = width; ink.setLineDash(dash);
      ink.beginPath();
      let open = false;
      for (const point of points) {
        if (!(point[0] === point[0])) { open = false; continue; }
        const [x, y] = this.project(...point);
        if (open) ink.lineTo(x, y); else ink.moveTo(x, y);
        open = true;
      }
      ink.stroke(); ink.setLineDash([]);
    }

    write(text, at, dx, dy) { const [x, y] = this.project(...at); this.ink.fillText(text, x + dx, y + dy); }

    at(k) { const i = 3 * (this.frame * this.data.sections.length + k); return [...this.marks.subarray(i, i + 3)]; }

    restLine() {
      if (this.lines) return this.line(this.data.lines.rest);
      return this.data.sections.map((_, k) => [...this.rest.subarray(3 * k, 3 * k + 3)]);
    }

    blade(t) {
      if (this.lines) {
        const k = nearest(this.lines.time, t);
        if (Math.abs(this.lines.time[k] - t) < 0.06) return this.line(k);
        return this.between(t);
      }
      return this.data.sections.map((_, k) => this.at(k));
    }

    // The blade line is kept once a second: in between it is carried along linearly.
    between(t) {
      const times = this.lines.time;
      let k = 0;
      while (k < times.length - 2 && times[k + 1] <= t) k += 1;
      const next = Math.min(k + 1, times.length - 1), span = times[next] - times[k];
      const share = span > 0 ? Math.max(0, Math.min(1, (t - times[k]) / span)) : 0;
      const [a, b] = [this.line(k), this.line(next)];
      return a.map((point, i) => (b[i] ? point.map((value, j) => value + share * (b[i][j] - value)) : point));
    }

    line(k) {
      const { points, count } = this.lines, found = [];
      for (let i = 0; i < count; i++) {
        const at = 3 * (k * count + i);
        if (points[at] === points[at]) found.push([points[at], points[at + 1], points[at + 2]]);
      }
      return found;
    }

    wires(t, colour) {
      for (const wire of this.data.wires) {
        const k = this.data.sections.findIndex((section) => section.name === wire.section);
        if (k >= 0) this.path([wire.at, this.at(k)], colour, 1, [2, 3]);
        this.mark(wire.at, wire.name, colour, "cross", colour);
      }
    }

    mark(at, name, colour, shape, text) {
      if (!(at[0] === at[0])) return;
      const ink = this.ink, [x, y] = this.project(...at);
      ink.strokeStyle = ink.fillStyle = colour; ink.lineWidth = 2;
      ink.beginPath();
      if (shape === "square") ink.fillRect(x - 5, y - 5, 10, 10);
      else if (shape === "cross") { ink.moveTo(x - 5, y - 5); ink.lineTo(x + 5, y + 5); ink.moveTo(x + 5, y - 5); ink.lineTo(x - 5, y + 5); ink.stroke(); }
      else { ink.arc(x, y, 5.5, 0, 7); ink.stroke(); }
      if (name) { ink.fillStyle = text; ink.textAlign = "left"; ink.fillText(name.length > 24 ? `${name.slice(0, 23)}…` : name, x + 9, y - 9); }
    }

    sections(text) {
      const every = Math.ceil(this.data.sections.length / 12);
      this.data.sections.forEach((section, k) => {
        this.mark(this.at(k), k % every ? "" : section.name, text, "ring", text);
      });
    }

    compass(text) {
      const ink = this.ink, origin = [46, this.height - 46], { right, up } = this.now3;
      ["x", "y", "z"].forEach((name, k) => {
        const tip = [origin[0] + right[k] * 28, origin[1] - up[k] * 28];
        ink.strokeStyle = ink.fillStyle = text; ink.lineWidth = 1.5; ink.textAlign = "center";
        ink.beginPath(); ink.moveTo(...origin); ink.lineTo(...tip); ink.stroke();
        ink.fillText(name, origin[0] + right[k] * 38, origin[1] - up[k] * 38);
      });
    }

    say(t) {
      const step = this.data.steps.of[this.frame];
      const name = step < 0 ? this.said.between : `${this.said.step} ${this.data.steps.names[step]}`;
      this.now.textContent = `${t.toFixed(2)} s, ${name}`;
      this.slider.setAttribute("aria-valuetext", this.now.textContent);
    }
  }

  document.querySelectorAll(".replay").forEach((figure) => { figure.replay = new Replay(figure); });
})();
