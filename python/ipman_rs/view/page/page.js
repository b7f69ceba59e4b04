"use strict";
(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const $ = (id) => document.getElementById(id);
  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const canvas = $("scene"), marks = $("marks"), pen = marks.getContext("2d");
  const table = bytes(data.heat), rgba = new Uint8Array(1024);
  for (let i = 0; i < 256; i++) rgba.set([table[3 * i], table[3 * i + 1], table[3 * i + 2], 255], 4 * i);
  const scene = makeScene(canvas, rgba);
  $("no-webgl").hidden = Boolean(scene);

  let body = null, mesh = null, frame = 0, timer = 0;
  const camera = { yaw: 0.6, pitch: 0.28, distance: 3, target: [0, 1, 0] };
  const look = { alpha: 100, gamma: 10, top: 1, clear: false, byPart: false, broken: false, center: [0, 0, 0], radius: 2, square: 0.5 };

  // ---- geometry -----------------------------------------------------------------------------------------------
  function unpack(b) {
    const shorts = new Uint16Array(bytes(b.vertices).buffer), n = 3 * b.numVertices;
    const raw = bytes(b.faces).buffer, faces = b.wide ? new Uint32Array(raw) : Uint32Array.from(new Uint16Array(raw));
    const parts = bytes(b.vertexParts), colors = new Float32Array(n);
    const palette = data.partColors.map((c) => [1, 3, 5].map((i) => parseInt(c.slice(i, i + 2), 16) / 255));
    parts.forEach((p, v) => colors.set(palette[p], 3 * v));
    return { faces, colors, positions: (key) => {
      const out = new Float32Array(n), from = key * n;
      for (let i = 0; i < n; i++) out[i] = b.low[i % 3] + b.step[i % 3] * shorts[from + i];
      return out;
    } };
  }
  function normalsOf(p, faces) {
    const n = new Float32Array(p.length);
    for (let i = 0; i < faces.length; i += 3) {
      const a = 3 * faces[i], b = 3 * faces[i + 1], c = 3 * faces[i + 2];
      const ux = p[b] - p[a], uy = p[b + 1] - p[a + 1], uz = p[b + 2] - p[a + 2];
      const vx = p[c] - p[a], vy = p[c + 1] - p[a + 1], vz = p[c + 2] - p[a + 2];
      const x = uy * vz - uz * vy, y = uz * vx - ux * vz, z = ux * vy - uy * vx;
      for (const k of [a, b, c]) { n[k] += x; n[k + 1] += y; n[k + 2] += z; }
    }
    for (let i = 0; i < n.length; i += 3) {
      const l = Math.hypot(n[i], n[i + 1], n[i + 2]) || 1;
      n[i] /= l; n[i + 1] /= l; n[i + 2] /= l;
    }
    return n;
  }
  function boxOf(p) {
    const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    for (let i = 0; i < p.length; i++) { low[i % 3] = Math.min(low[i % 3], p[i]); high[i % 3] = Math.max(high[i % 3], p[i]); }
    return { low, high };
  }
  const roundStep = (x) => { const p = 10 ** Math.floor(Math.log10(x));
    return [1, 2, 5, 10].map((k) => k * p).reduce((a, b) => (Math.abs(Math.log(b / x)) < Math.abs(Math.log(a / x)) ? b : a)); };

  // ---- camera -------------------------------------------------------------------------------------------------
  function axes() {
    const cy = Math.cos(camera.yaw), sy = Math.sin(camera.yaw), cp = Math.cos(camera.pitch), sp = Math.sin(camera.pitch);
    return { right: [cy, 0, -sy], up: [-sp * sy, cp, -sp * cy], back: [cp * sy, sp, cp * cy] };
  }
  const FIELD = 26 * Math.PI / 180;
  function matrices() {
    const { right, up, back } = axes(), t = camera.target, f = 1 / Math.tan(FIELD / 2);
    const eye = t.map((x, k) => x + camera.distance * back[k]);
    const near = camera.distance / 50, far = camera.distance * 50, aspect = canvas.width / canvas.height;
    const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    const rows = [right, up, back].map((r) => [...r, -dot(r, eye)]);
    const projection = [rows[0].map((x) => x * f / aspect), rows[1].map((x) => x * f),
      rows[2].map((x, k) => x * (far + near) / (near - far) + (k === 3 ? 2 * far * near / (near - far) : 0)), rows[2].map((x) => -x)];
    const view = new Float32Array(16), turn = new Float32Array(9);
    for (let r = 0; r < 4; r++) for (let c = 0; c < 4; c++) view[4 * c + r] = projection[r][c];
    for (let r = 0; r < 3; r++) for (let c = 0; c < 3; c++) turn[3 * c + r] = rows[r][c];
    return { view, turn };
  }
  function place(view, p) {
    const v = [0, 1, 3].map((r) => view[r] * p[0] + view[4 + r] * p[1] + view[8 + r] * p[2] + view[12 + r]);
    return [(v[0] / v[2] * 0.5 + 0.5) * marks.width, (0.5 - v[1] / v[2] * 0.5) * marks.height];
  }

  // ---- drawing ------------------------------------------------------------------------------------------------
  let asked = false;
  function redraw() { if (!asked) { asked = true; requestAnimationFrame(() => { asked = false; paint(); }); } }
  function paint() {
    if (!scene || !body) return;
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const width = Math.round(canvas.clientWidth * ratio), height = Math.round(canvas.clientHeight * ratio);
    for (const c of [canvas, marks]) if (c.width !== width || c.height !== height) { c.width = width; c.height = height; }
    const { view, turn } = matrices();
    scene.draw(view, turn, look);
    paintMarks(view, ratio);
  }
  function paintMarks(view, ratio) {
    pen.clearRect(0, 0, marks.width, marks.height);
    const shown = drawnFrame(), com = body.com[shown], cop = body.cop[shown], polygon = body.polygons[keyOf(frame)];
    const line = (points, color, width, dash = []) => {
      pen.beginPath(); points.forEach((p, k) => (k ? pen.lineTo(...p) : pen.moveTo(...p)));
      pen.strokeStyle = color; pen.lineWidth = width * ratio; pen.setLineDash(dash.map((d) => d * ratio)); pen.stroke();
    };
    const dot = (p, color, radius) => {
      pen.beginPath(); pen.arc(...p, radius * ratio, 0, 7); pen.fillStyle = color; pen.fill();
      pen.strokeStyle = "#fff"; pen.lineWidth = 2.2 * ratio; pen.setLineDash([]); pen.stroke();
    };
    pen.lineCap = "round"; pen.lineJoin = "round";
    if (polygon.length) { pen.globalAlpha = 0.5; line([...polygon, polygon[0]].map((p) => place(view, p)), data.colors.edge, 1.3); pen.globalAlpha = 1; }
    const good = (p) => p.every((x) => x !== null);
    const below = good(com) && place(view, [com[0], 0, com[2]]), at = good(cop) && place(view, [cop[0], 0, cop[2]]);
    if (below) {
      const head = place(view, com);
      line([head, below], "rgba(255,255,255,.75)", 5); line([head, below], data.colors.com, 2.2);
      if (at) line([below, at], "#24272d", 1.6, [4, 4]);
      dot(below, data.colors.com, 4); dot(head, data.colors.com, 9);
    }
    if (at) dot(at, data.colors.cop, 7);
  }

  // ---- frames -------------------------------------------------------------------------------------------------
  function keyOf(f) {
    let best = 0;
    body.keyFrames.forEach((k, i) => { if (Math.abs(k - f) < Math.abs(body.keyFrames[best] - f)) best = i; });
    return best;
  }
  const drawnFrame = () => body.keyFrames[keyOf(frame)];
  let shownKey = -1;
  function showFrame(f, reset = false) {
    frame = f;
    const key = keyOf(f);
    if (key !== shownKey || reset) {
      shownKey = key;
      const positions = mesh.positions(key), box = boxOf(positions);
      const size = Math.max(...box.high.map((x, k) => x - box.low[k]));
      look.center = [(box.low[0] + box.high[0]) / 2, 0, (box.low[2] + box.high[2]) / 2];
      if (reset || body.named) {
        look.square = roundStep(size / 5); look.radius = 1.6 * size;
        $("square").textContent = look.square >= 1 ? `${look.square} m` : `${+(100 * look.square).toPrecision(3)} cm`;
        fit(box);
      }
      camera.target = [look.center[0], (Math.min(box.low[1], 0) + box.high[1]) / 2, look.center[2]];
      look.broken = body.broken[key];
      if (scene) scene.setBody(positions, normalsOf(positions, mesh.faces), body.polygons[key], look.square);
    }
    $("slider").value = f;
    $("frame").textContent = body.labels[f];
    const far = drawnFrame() !== f;
    $("drawn").hidden = body.keyFrames.length === body.labels.length;
    $("drawn").textContent = `The 3D view holds ${body.keyFrames.length} of ${body.labels.length} frames; ` +
      (far ? `it shows ${body.labels[drawnFrame()]} now. ` : "it shows this one. ") + "Numbers and curves are those of every frame.";
    numbers(); highlight(); redraw();
  }
  function fit(box) {
    const size = box.high.map((x, k) => x - box.low[k]), aspect = Math.max(0.3, canvas.clientWidth / canvas.clientHeight);
    const across = Math.hypot(size[0], size[2]), tan = Math.tan(FIELD / 2);
    camera.distance = 1.12 * Math.max(size[1] * 0.5 / tan + across / 2, across * 0.5 / tan / aspect + across / 3, across * 0.2 / tan);
  }

  // ---- words --------------------------------------------------------------------------------------------------
  function say(value, factor = 1, digits = 1, unit = "") {
    if (value === null || value === undefined) return "–";
    const x = value * factor, tiny = digits > 2 && x !== 0 && Math.abs(x) < 10 ** -digits;
    const text = Math.abs(x) >= 1e7 ? x.toPrecision(3) : tiny ? x.toExponential(1) : x.toFixed(digits);
    return `${text.replace(/^-(0\.?0*)$/, "$1").replaceAll("-", "−")}${unit && " " + unit}`;
  }
  function element(name, text, className = "") { const e = document.createElement(name); e.textContent = text; e.className = className; return e; }
  function rows(list, entries) {
    list.replaceChildren(...entries.flatMap(([name, value]) => value === undefined ? [element("dt", name, "head")] : [element("dt", name), element("dd", value)]));
  }
  function numbers() {
    const v = (key) => body.numbers[key][frame];
    $("label").textContent = body.labels.length > 1 ? body.labels[frame] : body.name;
    const badges = v("mass") === null ? [["not measurable", "bad"]] : !v("has_contact") ? [["no contact", "bad"]]
      : v("bose") ? [["CoM over its support", "good"]] : [["CoM outside its support", "bad"]];
    body.status[frame].filter((s) => s !== "NO_CONTACT").forEach((s) => badges.push([s.toLowerCase().replaceAll("_", " "), "bad"]));
    if (body.level) badges.push([`fit: ${body.level}`, { green: "good", amber: "doubt", red: "bad" }[body.level]]);
    $("badges").replaceChildren(...badges.map(([text, kind]) => element("span", text, `badge ${kind}`)));
    const com = body.com[frame];
    rows($("numbers"), [
      ["Balance"], ["CoM–CoP distance", say(v("com_cop_distance"), 1e3, 1, "mm")], ["Margin", say(v("margin"), 1e3, 1, "mm")],
      ["Base of support", say(v("area"), 1e4, 0, "cm²")], ["Contact samples", say(v("num_contacts"), 1, 0)],
      ["Body"], ["Mass", say(v("mass"), 1, 2, "kg")], ["Volume", say(v("volume"), 1e3, 2, "l")],
      ["Height of the CoM", say(com[1], 1e3, 0, "mm")], ["Lowest point", say(v("lowest"), 1e3, 1, "mm")],
      [`Losses (${body.preset}, unweighted)`], ["Stability", say(v("stability"), 1, 4)], ["Ground pull", say(v("pull"), 1, 4)],
      ["Ground push", say(v("push"), 1, 4)], ["Balance cost", say(v("balance"), 1, 4, "nats")],
    ]);
    const volumes = body.partVolumes[keyOf(frame)];
    $("volumes").hidden = body.parts.length < 2 || drawnFrame() !== frame;
    rows($("parts"), body.parts.map((name, k) => [name.replaceAll("_", " "), say(volumes[k], 1e3, 2, "l")]));
  }

  const COLUMNS = [["CoM–CoP mm", "com_cop_distance", 1e3, 0], ["margin mm", "margin", 1e3, 0], ["support cm²", "area", 1e4, 0],
    ["contacts", "num_contacts", 1, 0], ["stability", "stability", 1, 3], ["pull", "pull", 1, 3], ["push", "push", 1, 3], ["balance nats", "balance", 1, 3]];
  function buildTable() {
    const head = document.createElement("tr");
    head.append(element("th", "pose"), ...COLUMNS.map(([title]) => element("th", title)));
    const lines = body.labels.map((label, f) => {
      const row = document.createElement("tr");
      row.append(element("td", label), ...COLUMNS.map(([, key, factor, digits]) =>
        element("td", say(body.numbers[key][f], factor, digits), key === "margin" && !body.numbers.bose[f] ? "bad" : "")));
      row.onclick = () => showFrame(f);
      return row;
    });
    const top = document.createElement("thead"), rest = document.createElement("tbody");
    top.append(head); rest.append(...lines);
    $("table").replaceChildren(top, rest);
  }

  // ---- plots --------------------------------------------------------------------------------------------------
  const SVG = "http://www.w3.org/2000/svg", W = 460, H = 150, L = 46, B = 20, T = 8;
  function svg(name, attributes, text = "") {
    const e = document.createElementNS(SVG, name);
    for (const [key, value] of Object.entries(attributes)) e.setAttribute(key, value);
    e.textContent = text;
    return e;
  }
  const xOf = (f) => L + (W - L - 6) * f / Math.max(1, body.labels.length - 1);
  function buildPlots() {
    $("plots").replaceChildren(...data.series.map(plot));
  }
  function plot(series) {
    const values = body.numbers[series.key].map((v) => (v === null ? null : v * series.factor));
    const known = values.filter((v) => v !== null);
    let low = Math.min(...bounds(known)), high = Math.max(...bounds(known));
    // A curve that hardly moves is shown flat, not as its rounding.
    const middle = (low + high) / 2, reach = Math.max(1.1 * (high - low) / 2, 0.02 * Math.abs(middle), 1e-3);
    low = middle - reach; high = middle + reach;
    const y = (v) => T + (H - T - B) * (high - v) / (high - low);
    const root = svg("svg", { viewBox: `0 0 ${W} ${H}` });
    const half = (xOf(1) - xOf(0)) / 2;
    let shade = "";
    body.numbers.bose.forEach((inside, f) => { if (!inside) shade += `M${xOf(f) - half} ${T}h${2 * half}v${H - T - B}h${-2 * half}z`; });
    root.append(svg("path", { d: shade, fill: "#fbe6e8" }));
    const step = roundStep((high - low) / 3);
    for (let v = Math.ceil(low / step) * step; v <= high; v += step) {
      root.append(svg("line", { x1: L, x2: W - 6, y1: y(v), y2: y(v), stroke: "#e4e7eb" }));
      root.append(svg("text", { x: L - 5, y: y(v) + 4, "text-anchor": "end" }, String(+v.toPrecision(4)).replace("-", "−")));
    }
    const last = body.labels.length - 1;
    [0, Math.round(last / 2), last].forEach((f, k) => root.append(svg("text", { x: xOf(f), y: H - 5, "text-anchor": ["start", "middle", "end"][k] },
      body.seconds ? `${+body.seconds[f].toFixed(2)} s` : `${f}`)));
    let path = "", pen = "M";
    values.forEach((v, f) => { if (v === null) pen = "M"; else { path += `${pen}${xOf(f).toFixed(2)} ${y(v).toFixed(2)}`; pen = "L"; } });
    root.append(svg("path", { d: path, fill: "none", stroke: series.color, "stroke-width": 1.8, "stroke-linejoin": "round" }));
    const cursor = svg("line", { y1: T, y2: H - B, stroke: "#24272d", "stroke-dasharray": "3 3", class: "cursor" });
    root.append(cursor);
    root.onpointerdown = (event) => {
      const box = root.getBoundingClientRect(), x = (event.clientX - box.left) / box.width * W;
      showFrame(Math.min(last, Math.max(0, Math.round((x - L) / (W - L - 6) * last))));
    };
    const figure = document.createElement("figure"), caption = element("figcaption", series.title + (series.unit && ` (${series.unit})`));
    const now = element("span", "");
    caption.append(now); figure.append(caption, root);
    figure.show = () => { cursor.setAttribute("x1", xOf(frame)); cursor.setAttribute("x2", xOf(frame)); now.textContent = say(values[frame], 1, series.factor > 1 ? 1 : 4); };
    return figure;
  }
  function bounds(values) { return values.reduce(([a, b], v) => [Math.min(a, v), Math.max(b, v)], [Infinity, -Infinity]).map((v) => (Number.isFinite(v) ? v : 0)); }
  function highlight() {
    if (body.named) [...$("table").tBodies[0].rows].forEach((row, f) => row.classList.toggle("now", f === frame));
    else if (body.labels.length > 1) for (const figure of $("plots").children) figure.show();
  }

  // ---- choosing -----------------------------------------------------------------------------------------------
  function showBody(index) {
    body = data.bodies[index]; mesh = unpack(body); stop();
    $("title").textContent = body.name;
    $("source").textContent = body.source;
    $("method").textContent = body.method === "pcom" ? "(part-wise, pCoM)" : "(exact)";
    $("heat-top").textContent = `${body.top >= 3 ? "≥ " : ""}${+body.top.toPrecision(2)}`;
    $("flags").replaceChildren(...body.flags.map((flag) => element("li", flag)));
    $("flags").hidden = !body.flags.length;
    $("notes").replaceChildren(...body.notes.map((note) => element("li", note)));
    $("stages").replaceChildren(...body.stages.map((stage) => element("li", stage)));
    $("solver").hidden = !body.stages.length;
    $("pictures-card").hidden = !body.pictures.length;
    $("pictures").replaceChildren(...body.pictures.map(({ title, src }) => {
      const figure = document.createElement("figure"), image = document.createElement("img");
      Object.assign(image, { src, alt: title });
      figure.append(element("figcaption", title), image);
      return figure;
    }));
    $("parts-choice").hidden = body.parts.length < 2;
    if (body.parts.length < 2) { look.byPart = false; document.querySelector("[name=skin]").checked = true; }
    Object.assign(look, { alpha: body.alpha, gamma: body.gamma, top: body.top });
    if (scene) scene.setFaces(mesh.faces, mesh.colors);
    const many = body.labels.length > 1;
    $("player").hidden = !many; $("slider").max = body.labels.length - 1;
    $("table-card").hidden = !(many && body.named); $("plots-card").hidden = !many || body.named;
    if (many && body.named) buildTable(); else if (many) buildPlots();
    Object.assign(camera, { yaw: 0.6, pitch: 0.28 });
    showFrame(0, true);
  }
  function stop() { clearTimeout(timer); timer = 0; $("play").textContent = "▶"; }
  function play() {
    if (timer) return stop();
    $("play").textContent = "❚❚";
    const next = () => {
      const f = body.keyFrames[(keyOf(frame) + 1) % body.keyFrames.length];
      const gap = body.seconds ? Math.abs(body.seconds[f] - body.seconds[drawnFrame()]) * 1000 : 100;
      showFrame(f);
      timer = setTimeout(next, body.named ? 1200 : Math.min(500, Math.max(30, gap)));
    };
    timer = setTimeout(next, 0);
    return undefined;
  }

  const held = new Map();
  let pinch = 0;
  canvas.onpointerdown = (e) => { held.set(e.pointerId, [e.clientX, e.clientY]); pinch = 0; try { canvas.setPointerCapture(e.pointerId); } catch { /* a synthetic event has no pointer to hold */ } };
  canvas.onpointerup = canvas.onpointercancel = (e) => { held.delete(e.pointerId); pinch = 0; };
  canvas.onpointermove = (e) => {
    const was = held.get(e.pointerId);
    if (!was) return;
    const dx = e.clientX - was[0], dy = e.clientY - was[1];
    held.set(e.pointerId, [e.clientX, e.clientY]);
    if (held.size === 2) {
      const [a, b] = [...held.values()], width = Math.hypot(a[0] - b[0], a[1] - b[1]);
      if (pinch) zoom(pinch / width);
      pinch = width;
    } else {
      camera.yaw -= dx * 0.008; camera.pitch = Math.min(1.5707, Math.max(-0.4, camera.pitch + dy * 0.008));
    }
    redraw();
  };
  function zoom(factor) { camera.distance = Math.min(60 * look.square, Math.max(0.5 * look.square, camera.distance * factor)); redraw(); }
  canvas.addEventListener("wheel", (e) => { e.preventDefault(); zoom(Math.exp(Math.max(-60, Math.min(60, e.deltaY)) * 0.002)); }, { passive: false });
  $("slider").oninput = (e) => { stop(); showFrame(Number(e.target.value)); };
  $("play").onclick = play;
  $("bodies").onchange = (e) => showBody(Number(e.target.value));
  $("clear").onchange = (e) => { look.clear = e.target.checked; redraw(); };
  document.querySelectorAll("[name=skin]").forEach((input) => { input.onchange = () => { look.byPart = input.value === "parts"; redraw(); }; });
  $("top").onclick = () => { Object.assign(camera, { yaw: 0, pitch: 1.5707 }); redraw(); };
  $("home").onclick = () => { Object.assign(camera, { yaw: 0.6, pitch: 0.28 }); showFrame(frame, true); };
  document.addEventListener("keydown", (e) => {
    const step = { ArrowLeft: -1, ArrowRight: 1 }[e.key];
    if (step && !/INPUT|SELECT/.test(e.target.tagName)) showFrame(Math.min(body.labels.length - 1, Math.max(0, frame + step)));
  });
  window.addEventListener("resize", redraw);
  $("choose").hidden = data.bodies.length < 2;
  if (data.bodies.length) showBody(0);
})();
