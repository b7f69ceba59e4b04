"use strict";
// The body on its floor in WebGL 2. World axes: y up from the ground, metres. Markers are drawn by page.js on a canvas above.

function makeScene(canvas, heatTable) {
  const gl = canvas.getContext("webgl2", { antialias: true, alpha: false, powerPreference: "low-power" });
  if (!gl) return null;

  const BODY_VERTEX = `#version 300 es
    uniform mat4 view; uniform mat3 turn; in vec3 position; in vec3 normal; in vec3 part;
    out vec3 n; out float height; out vec3 tint;
    void main() { n = turn * normal; height = position.y; tint = part; gl_Position = view * vec4(position, 1.0); }`;
  const BODY_FRAGMENT = `#version 300 es
    precision highp float;
    uniform sampler2D heat; uniform float alpha, gamma, top, opacity; uniform bool byPart;
    in vec3 n; in float height; in vec3 tint; out vec4 color;
    void main() {
      float rho = height < 0.0 ? 1.0 - alpha * height : exp(-gamma * height);
      vec3 albedo = byPart ? tint : texture(heat, vec2(clamp(rho / top, 0.002, 0.998), 0.5)).rgb;
      vec3 m = normalize(n); if (m.z < 0.0) m = -m;
      float light = 0.46 + 0.28 * (0.5 + 0.5 * m.y) + 0.46 * max(dot(m, vec3(-0.45, 0.62, 0.64)), 0.0);
      float gloss = pow(max(dot(m, vec3(-0.25, 0.34, 0.91)), 0.0), 40.0);
      vec3 linear = pow(albedo, vec3(2.2)) * pow(light, 1.4) + 0.05 * gloss;
      color = vec4(pow(min(linear, 1.0), vec3(1.0 / 2.2)) * (1.0 - 0.25 * pow(1.0 - clamp(m.z, 0.0, 1.0), 3.0)), opacity);
    }`;
  // The shadow: the body seen from below, the lowest skin on top, as darkness near and far.
  const SHADOW_VERTEX = `#version 300 es
    uniform vec4 area; in vec3 position; out float height;
    void main() { height = max(position.y, 0.0);
      gl_Position = vec4((position.xz - area.xy) / area.z, clamp(position.y / area.w, -1.0, 1.0), 1.0); }`;
  const SHADOW_FRAGMENT = `#version 300 es
    precision highp float; in float height; out vec4 color;
    void main() { color = vec4(exp(-height / 0.06), exp(-height / 0.8), 0.0, 1.0); }`;
  const FLOOR_VERTEX = `#version 300 es
    uniform mat4 view; uniform vec3 center; uniform float radius; in vec2 corner; out vec2 place;
    void main() { place = center.xz + corner * radius; gl_Position = view * vec4(place.x, 0.0, place.y, 1.0); }`;
  const FLOOR_FRAGMENT = `#version 300 es
    precision highp float;
    uniform sampler2D shadow; uniform vec4 area; uniform vec3 center; uniform float radius, square; in vec2 place; out vec4 color;
    float lines(float width) {
      vec2 at = place / square; vec2 away = abs(fract(at - 0.5) - 0.5) / fwidth(at);
      return 1.0 - clamp(min(away.x, away.y) - width, 0.0, 1.0); }
    void main() {
      vec2 seat = (place - area.xy) / area.z * 0.5 + 0.5; vec2 dark = vec2(0.0); float total = 0.0;
      for (int i = -4; i <= 4; i++) for (int j = -4; j <= 4; j++) {
        float w = exp(-float(i * i + j * j) / 8.0); total += w;
        dark.x += w * texture(shadow, seat + vec2(i, j) * 0.0022).r; dark.y += w * texture(shadow, seat + vec2(i, j) * 0.008).g; }
      dark /= total;
      float fade = clamp(1.0 - pow(length(place - center.xz) / radius, 2.0), 0.0, 1.0);
      vec3 base = mix(vec3(1.0), vec3(0.79, 0.81, 0.84), lines(0.4) * fade);
      color = vec4(mix(base, vec3(0.23, 0.25, 0.29), 0.36 * dark.x + 0.24 * dark.y), 1.0);
    }`;
  const FLAT_VERTEX = `#version 300 es
    uniform mat4 view; in vec3 position; void main() { gl_Position = view * vec4(position, 1.0); }`;
  const FLAT_FRAGMENT = `#version 300 es
    precision highp float; uniform vec4 paint; out vec4 color; void main() { color = paint; }`;

  function program(vertex, fragment) {
    const made = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text); gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(made, shader);
    }
    ["position", "normal", "part", "corner"].forEach((name, k) => gl.bindAttribLocation(made, name === "corner" ? 0 : k, name));
    gl.linkProgram(made);
    if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made));
    return { made, at: (name) => gl.getUniformLocation(made, name) };
  }
  const body = program(BODY_VERTEX, BODY_FRAGMENT), shade = program(SHADOW_VERTEX, SHADOW_FRAGMENT);
  const floor = program(FLOOR_VERTEX, FLOOR_FRAGMENT), flat = program(FLAT_VERTEX, FLAT_FRAGMENT);
  const buffers = { position: gl.createBuffer(), normal: gl.createBuffer(), part: gl.createBuffer(), faces: gl.createBuffer(),
    corner: gl.createBuffer(), fill: gl.createBuffer(), edge: gl.createBuffer() };

  function fill(buffer, values, target = gl.ARRAY_BUFFER) {
    gl.bindBuffer(target, buffer); gl.bufferData(target, values, gl.DYNAMIC_DRAW);
  }
  function feed(slot, buffer, size) {
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer); gl.enableVertexAttribArray(slot);
    gl.vertexAttribPointer(slot, size, gl.FLOAT, false, 0, 0);
  }
  fill(buffers.corner, new Float32Array([-1, -1, 1, -1, -1, 1, 1, 1]));

  function texture(width, height, pixels, smooth) {
    const made = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, made);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, width, height, 0, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, name, smooth);
    for (const name of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, name, gl.CLAMP_TO_EDGE);
    return made;
  }
  const heat = texture(256, 1, heatTable, gl.LINEAR);
  const SHADOW_SIZE = 512;
  const shadow = texture(SHADOW_SIZE, SHADOW_SIZE, null, gl.LINEAR);
  const target = gl.createFramebuffer(), depth = gl.createRenderbuffer();
  gl.bindFramebuffer(gl.FRAMEBUFFER, target);
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, shadow, 0);
  gl.bindRenderbuffer(gl.RENDERBUFFER, depth);
  gl.renderbufferStorage(gl.RENDERBUFFER, gl.DEPTH_COMPONENT16, SHADOW_SIZE, SHADOW_SIZE);
  gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.RENDERBUFFER, depth);
  gl.bindFramebuffer(gl.FRAMEBUFFER, null);

  let count = 0, fillCount = 0, edgeCount = 0, area = [0, 0, 1, 1];

  function setFaces(faces, partColors) { count = faces.length; fill(buffers.faces, faces, gl.ELEMENT_ARRAY_BUFFER); fill(buffers.part, partColors); }

  function setBody(positions, normals, polygon, square) {
    fill(buffers.position, positions); fill(buffers.normal, normals);
    const fan = [], ribbon = [], width = 0.012 * square;
    polygon.forEach((p, k) => {
      const q = polygon[(k + 1) % polygon.length], r = polygon[0];
      if (k > 0 && k + 1 < polygon.length) fan.push(r[0], 0, r[2], p[0], 0, p[2], q[0], 0, q[2]);
      const length = Math.hypot(q[0] - p[0], q[2] - p[2]) || 1;
      const x = width * (q[2] - p[2]) / length, z = -width * (q[0] - p[0]) / length;
      const a = [p[0] + x, 0, p[2] + z], b = [p[0] - x, 0, p[2] - z], c = [q[0] + x, 0, q[2] + z], d = [q[0] - x, 0, q[2] - z];
      ribbon.push(...a, ...b, ...c, ...c, ...b, ...d);
    });
    fillCount = fan.length / 3; edgeCount = ribbon.length / 3;
    fill(buffers.fill, new Float32Array(fan)); fill(buffers.edge, new Float32Array(ribbon));
    drawShadow(positions);
  }

  function drawShadow(p) {
    let low = [Infinity, Infinity], high = [-Infinity, -Infinity], tall = 0.1;
    for (let i = 0; i < p.length; i += 3) {
      low = [Math.min(low[0], p[i]), Math.min(low[1], p[i + 2])]; high = [Math.max(high[0], p[i]), Math.max(high[1], p[i + 2])];
      tall = Math.max(tall, Math.abs(p[i + 1]));
    }
    const half = Math.max(high[0] - low[0], high[1] - low[1], 0.01) * 0.75;
    area = [(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, half, tall * 1.01];
    gl.bindFramebuffer(gl.FRAMEBUFFER, target);
    gl.viewport(0, 0, SHADOW_SIZE, SHADOW_SIZE);
    gl.clearColor(0, 0, 0, 0); gl.enable(gl.DEPTH_TEST); gl.depthMask(true); gl.disable(gl.BLEND);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.useProgram(shade.made); gl.uniform4fv(shade.at("area"), area);
    feed(0, buffers.position, 3); gl.disableVertexAttribArray(1); gl.disableVertexAttribArray(2);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, buffers.faces); gl.drawElements(gl.TRIANGLES, count, gl.UNSIGNED_INT, 0);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  }

  function drawFlat(view, buffer, vertices, paint) {
    gl.useProgram(flat.made); gl.uniformMatrix4fv(flat.at("view"), false, view); gl.uniform4fv(flat.at("paint"), paint);
    feed(0, buffer, 3); gl.drawArrays(gl.TRIANGLES, 0, vertices);
  }

  function draw(view, turn, look) {
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(1, 1, 1, 1); gl.depthMask(true); gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.disable(gl.DEPTH_TEST); gl.enable(gl.BLEND); gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    gl.disableVertexAttribArray(1); gl.disableVertexAttribArray(2);
    gl.useProgram(floor.made);
    gl.uniformMatrix4fv(floor.at("view"), false, view); gl.uniform4fv(floor.at("area"), area);
    gl.uniform3fv(floor.at("center"), look.center); gl.uniform1f(floor.at("radius"), look.radius); gl.uniform1f(floor.at("square"), look.square);
    gl.activeTexture(gl.TEXTURE0); gl.bindTexture(gl.TEXTURE_2D, shadow);
    feed(0, buffers.corner, 2); gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
    drawFlat(view, buffers.fill, fillCount, [1, 0.824, 0.122, 0.5]);
    drawFlat(view, buffers.edge, edgeCount, [0.878, 0.659, 0, 1]);
    if (look.broken) return;
    gl.enable(gl.DEPTH_TEST);
    gl.useProgram(body.made);
    gl.uniformMatrix4fv(body.at("view"), false, view); gl.uniformMatrix3fv(body.at("turn"), false, turn);
    gl.uniform1f(body.at("alpha"), look.alpha); gl.uniform1f(body.at("gamma"), look.gamma); gl.uniform1f(body.at("top"), look.top);
    gl.uniform1f(body.at("opacity"), look.clear ? 0.45 : 1); gl.uniform1i(body.at("byPart"), look.byPart ? 1 : 0);
    gl.bindTexture(gl.TEXTURE_2D, heat);
    feed(0, buffers.position, 3); feed(1, buffers.normal, 3); feed(2, buffers.part, 3);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, buffers.faces);
    // Depth first, colour after: a see-through body shows its front only.
    gl.colorMask(false, false, false, false); gl.drawElements(gl.TRIANGLES, count, gl.UNSIGNED_INT, 0);
    gl.colorMask(true, true, true, true); gl.depthFunc(gl.LEQUAL); gl.drawElements(gl.TRIANGLES, count, gl.UNSIGNED_INT, 0);
    gl.depthFunc(gl.LESS);
  }
  return { setFaces, setBody, draw };
}
